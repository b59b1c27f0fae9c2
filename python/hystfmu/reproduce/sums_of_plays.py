"""What thousands of plays cost: their fit (20 h in Shen & Ma 2017) and, by turning points, one step of their sum."""

from __future__ import annotations

import time

import numpy as np

from hystfmu import signals
from hystfmu.core import Array
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node
from hystfmu.identify import fit
from hystfmu.identify.plays import plays, thresholds
from hystfmu.reproduce import Row

STEPS, REPEATS = 400_000, 5


def fit_rows() -> list[Row]:
    """S4: fits without noise, 2000 samples; the plant's thresholds are among the model's."""
    u = signals.training(60, 1)[:2000]
    rows = []
    for n, target in ((100, 0.02), (1000, 0.5), (5000, 5.0)):
        r = thresholds(u, n)[n // 20 :: n // 10]
        data = Dataset.from_signal(u, 3 * u + plays(u, r, 0.0).sum(axis=1))
        best = min(
            (fit(data, "prandtl_ishlinskii", N=n) for _ in range(REPEATS if n <= 1000 else 1)),
            key=lambda m: m.fit["seconds"],
        )
        note = f"largest error {best.fit['max_percent'] / 100:.1e} of span, no noise"
        rows.append(Row(f"PI fit, 2000 samples, N = {n}, s", ours=best.fit["seconds"], target=target, note=note))
    return rows


def step_rows() -> list[Row]:
    """S5: the operator by its turning points against a state for every play, signed weights."""
    rng = np.random.default_rng(0)
    levels = rng.uniform(-1, 1, STEPS // 10 + 1)
    u = np.interp(np.arange(STEPS) / 10, np.arange(len(levels)), levels)
    even, uneven = (_graph("prandtl_ishlinskii", r, rng) for r in (np.linspace(0, 0.95, 5000), _uneven(rng, 5000)))
    some = _uneven(rng, 1000)
    weights = rng.integers(1 << 30)
    fast, plain = (_graph(name, some, np.random.default_rng(weights)).run(u) for name in BLOCKS)
    return [
        Row(
            "sum of 1000 plays, turning points | plain loop, 400000 steps, largest difference / largest output",
            ours=float(np.abs(fast - plain).max() / np.abs(plain).max()),
            target=2e-14,
            note="uneven thresholds, signed weights",
        ),
        Row("sum of 5000 plays, even thresholds, ns per step", ours=_nanoseconds(even, u), target=25.0),
        Row("sum of 5000 plays, uneven thresholds, ns per step", ours=_nanoseconds(uneven, u), target=100.0),
    ]


BLOCKS = ("prandtl_ishlinskii", "backlash_sum")


def _uneven(rng: np.random.Generator, n: int) -> Array:
    return np.sort(rng.uniform(0, 0.95, n))


def _graph(block: str, r: Array, rng: np.random.Generator) -> Graph:
    return Graph.single(Node("plays", block, {}, {"w0": 0.3, "r": r, "w": rng.normal(size=len(r)) / len(r)}))


def _nanoseconds(graph: Graph, u: Array) -> float:
    """Least time of a step in the graph, over some runs."""
    executor, rows = graph.executor(), np.ascontiguousarray(u[:, None])
    best = np.inf
    for _ in range(REPEATS):
        begin = time.perf_counter()
        executor.run(rows, 1, 1.0)
        best = min(best, time.perf_counter() - begin)
    return 1e9 * best / len(u)
