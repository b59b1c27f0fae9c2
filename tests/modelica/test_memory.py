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
    parts = [f"HystFMU.Operators.Sampled.ZhaoTan d{d}(depth = {d}, Ts = 0.1);" for d in DEPTHS]
    wires = [f"connect(signal.r, d{d}.x);" for d in DEPTHS]
    levels = ", ".join(map(repr, u.tolist()))
    file = tmp_path / "M.mo"
    file.write_text(
        f"model M HystFMU.Sources.Steps signal(m = {len(u)}, levels = {{{levels}}}, T = 0.1); {' '.join(parts)} "
        f"equation {' '.join(wires)} end M;"
    )
    assert simulate.rumoca(file, "M", repr(0.1 * len(u)), "0.1", "1e-6", tmp_path / "r.npz") == ""
    with np.load(tmp_path / "r.npz") as stored:
        rows = simulate.Trajectory({k: stored[k] for k in stored.files}).at(0.1)
    for d in DEPTHS:
        expected = Graph.single(Node("tested", "zhao_tan", {"depth": d}, {})).run(rows["signal.r"])
        assert rows[f"d{d}.extrema[1]"].max() == d, "the list was never full"
        assert np.abs(rows[f"d{d}.h"] - expected).max() <= 1e-12 * np.abs(expected).max()
