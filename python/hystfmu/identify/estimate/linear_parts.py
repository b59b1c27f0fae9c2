"""Search for free parameters on which the output depends linearly, by simulations of the graph.

A parameter is linear if two equal steps of this parameter change the output by the same amount. Several parameters are
jointly linear if the change of the output by each one does not depend on the others. The simulations also use random
values near the values of the graph. Otherwise a weight of 0 would hide the effect of the parameters that it multiplies.
The test does not use knowledge about the blocks, so a new block needs no further code.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.data import Dataset
from hystfmu.graph import Graph
from hystfmu.identify.estimate.free import Free
from hystfmu.identify.estimate.objective import Linear
from hystfmu.identify.estimate.runs import Runs
from hystfmu.model import rows_of

ROWS = 1000  # maximum number of rows of a simulation
EQUAL = 1e-9  # relative difference up to which two changes of the output count as equal


def linear_parts(graph: Graph, frees: Sequence[Free], data: Dataset, seed: int = 0) -> tuple[Linear, ...]:
    """Return the parameters that linear least squares can compute, so that no search is needed for them.

    They are jointly linear and have no bound except a lower bound of 0. `seed` is the seed of the random values.
    """
    able = [f for f in frees if _may(f)]
    if not able:
        return ()
    rng = np.random.default_rng(seed)
    stride = max(1, data.train.stop // ROWS)  # the test needs the turning points of the input, but not its dynamics
    rows = rows_of(graph, data).reshape(len(data.u), -1)[: data.train.stop : stride][:ROWS]
    runs = Runs(graph)

    def run(values: Mapping[str, Array]) -> Array | None:
        with suppress(InputError):
            runs.put(values)
            y = runs.run(rows, data.h)
            return y if np.isfinite(y).all() else None
        return None

    start = {f.place: graph.node(f.node).value(f.parameter) for f in able}

    def moved(values: Mapping[str, Array], free: Free, by: Array) -> dict[str, Array]:
        whole = values[free.place].copy()
        whole[list(free.elements)] += by
        return {**values, free.place: whole}

    sizes = [np.where(f.start == 0, 1.0, np.abs(f.start)) for f in able]
    steps = [rng.uniform(0.5, 1.5, len(size)) * size for size in sizes]

    def zeroed(chosen: Sequence[int]) -> bool:
        """Return whether the core accepts the value 0 for these parameters, which is needed to compute a column."""
        values = dict(start)
        for i in chosen:
            values = moved(values, able[i], -values[able[i].place][list(able[i].elements)])
        return run(values) is not None

    around = start
    for free, step in zip(able, steps, strict=True):
        other = moved(around, free, rng.uniform(0.1, 1) * step)
        if run(other) is not None:
            around = other

    def affine(values: Mapping[str, Array], i: int) -> bool:
        y = [run(moved(values, able[i], k * steps[i])) for k in (0, 1, 2)]
        still = y[0] is not None and y[1] is not None and np.array_equal(y[0], y[1])
        return not still and _equal(y[0], y[1], y[1], y[2])

    def apart(i: int, j: int) -> bool:
        at = moved(around, able[i], steps[i])
        y = [run(around), run(at), run(moved(around, able[j], steps[j])), run(moved(at, able[j], steps[j]))]
        return _equal(*y)

    chosen: list[int] = []
    order = {n.name: k for k, n in enumerate(graph.nodes)}
    likely = sorted(range(len(able)), key=lambda i: (-len(able[i].elements), -order[able[i].node]))
    for i in likely:
        if affine(start, i) and affine(around, i) and all(apart(i, j) for j in chosen) and zeroed([*chosen, i]):
            chosen.append(i)
    return tuple(Linear(able[i].place, able[i].elements, able[i].lo == 0) for i in sorted(chosen))


def _may(free: Free) -> bool:
    """Return whether a parameter has no bound except a lower bound of 0, no scale and no constraint."""
    plain = free.scale is None and not free.rises and free.sum is None
    return plain and free.lo in (0.0, -np.inf) and free.hi == np.inf


def _equal(a: Array | None, b: Array | None, c: Array | None, d: Array | None) -> bool:
    """Return whether b - a and d - c are equal up to rounding."""
    if a is None or b is None or c is None or d is None:
        return False
    size = max(float(np.abs(v).max()) for v in (a, b, c, d))
    change = float(np.abs(b - a).max())
    return bool(np.abs((b - a) - (d - c)).max() <= EQUAL * change + 1e-13 * size)
