"""The memory of dominant extrema when its list is full: nested loops are forgotten, and one sweep closes all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import simulate

from hystfmu.graph import Graph, Node

DEPTHS = (4, 5, 8)


def bursts(rows: int) -> np.ndarray:
    """Bursts of decaying reversals of random length and size: each begins with a sweep across the ones before."""
    rng = np.random.default_rng(0)
    found: list[float] = []
    while len(found) < rows:
        size = rng.choice([-1, 1]) * rng.uniform(0.5, 2)
        found += [size * (-0.93) ** j for j in range(rng.integers(2, 14))]
    return np.array(found[:rows])


def test_full_memory_agrees_with_the_c_core(tmp_path: Path) -> None:
    u = bursts(90)
    rows = simulated(u, DEPTHS, tmp_path)
    for d in DEPTHS:
        expected = Graph.single(Node("tested", "zhao_tan", {"depth": d}, {})).run(u)
        assert rows[f"d{d}.extrema[1]"].max() == d, "the list was never full"
        assert np.abs(rows[f"d{d}.h"] - expected).max() <= 1e-12 * np.abs(expected).max()


CASES = 1000


def reversals_of_a_rounding() -> np.ndarray:
    """Peaks of growing size on either side of x0, each with a reversal of one to three roundings behind it.

    A peak passes the mirror image of the one before, so that it is on the virgin branch: the reversal is its outermost
    extremum.  From there the input falls some way, and comes back to below or above the peak.
    """
    rng = np.random.default_rng(5)
    found: list[float] = []
    for k in range(CASES):
        peak = X0 + (-1) ** k * 1.0006**k * rng.uniform(0.7, 0.7002)
        behind = peak
        for _ in range(rng.integers(1, 4)):
            behind = np.nextafter(behind, X0)
        within = X0 + (peak - X0) * rng.uniform(-0.9, 0.95)
        again = X0 + (peak - X0) * rng.choice([rng.uniform(0.96, 0.99), 1 + rng.uniform(0, 1e-6)])
        found += [peak, behind, within, again]
    return np.array(found)


X0 = 1.0


def test_reversal_of_one_rounding_behind_a_peak_agrees_with_the_c_core(tmp_path: Path) -> None:
    u = reversals_of_a_rounding()
    memory = Graph.single(Node("tested", "zhao_tan", {"depth": 8}, {"x0": X0}))
    lost = np.abs(u[1::4] - X0) == np.abs(u[::4] - X0)  # what a comparison without a sign takes for a loop that closes
    assert np.count_nonzero(lost) > 100
    rows = simulated(u, (8,), tmp_path, X0)
    expected = memory.run(u)
    assert len(expected) == 4 * CASES
    assert np.abs(rows["d8.h"] - expected).max() <= 1e-12 * np.abs(expected).max()


def simulated(u: np.ndarray, depths: tuple[int, ...], tmp_path: Path, x0: float = 0.0) -> dict[str, np.ndarray]:
    """Zhao-Tan operators with lists of several lengths on the levels u, one at each sample."""
    parts = [f"HystFMU.Operators.Sampled.ZhaoTan d{d}(depth = {d}, x0 = {x0!r}, Ts = 0.1);" for d in depths]
    wires = [f"connect(signal.r, d{d}.x);" for d in depths]
    levels = ", ".join(map(repr, u.tolist()))
    file = tmp_path / "M.mo"
    file.write_text(
        f"model M HystFMU.Sources.Steps signal(m = {len(u)}, levels = {{{levels}}}, T = 0.1); {' '.join(parts)} "
        f"equation {' '.join(wires)} end M;"
    )
    assert simulate.rumoca(file, "M", repr(0.1 * len(u)), "0.1", "1e-6", tmp_path / "r.npz") == ""
    with np.load(tmp_path / "r.npz") as stored:
        rows = simulate.Trajectory({k: stored[k] for k in stored.files}).at(0.1)
    assert np.array_equal(rows["signal.r"], u)
    return rows
