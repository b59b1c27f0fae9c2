"""Run times of sums of thousands of plays: time of a fit (20 h in Shen & Ma 2017) and time of a simulation step.

The simulation step is computed by two methods: from stored turning points, or with one state per play.
"""

import time

import numpy as np

from hystfmu.base import Array
from hystfmu.data import Dataset, signals
from hystfmu.graph import Graph, Node
from hystfmu.identify import fit
from hystfmu.identify.features.plays import plays, thresholds
from papers.table import Row, Stated

ROW = Stated(__name__)

STEPS, REPEATS = 400_000, 5
TIMED, RUNS = 20_000, 50  # number of steps and runs in a timing; the minimum of many short runs excludes other load
BLOCKS = ("prandtl_ishlinskii", "backlash_sum")  # block that stores turning points; block with one state per play


def fit_rows() -> list[Row]:
    """Return table rows with the times of fits of 100, 1000 and 5000 plays to 2000 samples without noise.

    The samples are the output of a linear term and plays, whose thresholds are a subset of the thresholds of the model.
    """
    u = signals.training(60, 1)[:2000]
    rows = []
    for n, target in ((100, 0.02), (1000, 0.5), (5000, 5.0)):
        r = thresholds(u, n)[n // 20 :: n // 10]
        data = Dataset.from_signal(u, 3 * u + plays(u, r, 0.0).sum(axis=1))
        best = min(
            (fit(data, "prandtl_ishlinskii", N=n) for _ in range(REPEATS if n <= 1000 else 1)),
            key=lambda m: m.fit["seconds"],
        )
        error = best.fit["max_percent"] / 100
        rows.append(ROW("fit", ours=best.fit["seconds"], target=target, n=n, error=error))
    return rows


def step_rows() -> list[Row]:
    """Return table rows that compare a step by turning points with a step by one state per play.

    The rows contain the largest difference of the outputs, and the time of one step. The weights of the plays have both
    signs.
    """
    rng = np.random.default_rng(0)
    levels = rng.uniform(-1, 1, STEPS // 10 + 1)
    u = np.interp(np.arange(STEPS) / 10, np.arange(len(levels)), levels)
    some, even, uneven = ([_graph(b, r, w) for b in BLOCKS] for r, w in _operators(rng))
    fast, plain = (graph.run(u) for graph in some)
    return [
        ROW("same", ours=float(np.abs(fast - plain).max() / np.abs(plain).max())),
        *(
            ROW(
                "step",
                nanoseconds(graphs[1], u[: TIMED // 10], RUNS // 5),
                nanoseconds(graphs[0], u[:TIMED], RUNS),
                target=target,
                name=name,
            )
            for name, graphs, target in (("even", even, 25.0), ("uneven", uneven, 100.0))
        ),
    ]


def _operators(rng: np.random.Generator) -> list[tuple[Array, Array]]:
    """Return three pairs of thresholds and random weights of both signs.

    The pairs have 1000 random, 5000 equally spaced and 5000 random thresholds.
    """
    r = [np.sort(rng.uniform(0, 0.95, 1000)), np.linspace(0, 0.95, 5000), np.sort(rng.uniform(0, 0.95, 5000))]
    return [(v, rng.normal(size=len(v)) / len(v)) for v in r]


def _graph(block: str, r: Array, w: Array) -> Graph:
    return Graph.single(Node("plays", block, {}, {"w0": 0.3, "r": r, "w": w}))


def nanoseconds(graph: Graph, u: Array, runs: int) -> float:
    """Run a graph several times with the input u (n,), and return the smallest time per step (ns).

    `runs` is the number of runs.
    """
    executor, rows = graph.executor(), np.ascontiguousarray(u[:, None])
    best = np.inf
    for _ in range(runs):
        begin = time.perf_counter()
        executor.run(rows, 1, 1.0)
        best = min(best, time.perf_counter() - begin)
    return 1e9 * best / len(u)
