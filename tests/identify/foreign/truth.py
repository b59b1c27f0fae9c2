"""What a fit of the true structure reaches on a record: the numbers of a device, fitted from the true ones on."""

import numpy as np
from scipy.optimize import least_squares

import hystfmu as hy
from foreign.devices import DEVICES, Run
from foreign.graphs import GRAPHS


class Parameters:
    """A generator that keeps the ranges of what a device draws, or gives parameters in their place."""

    def __init__(self, drawn, given=None) -> None:
        self.drawn, self.given = drawn, None if given is None else list(given)
        self.ranges: list[tuple[float, float]] = []
        self.values: list[float] = []

    def uniform(self, lo: float, hi: float, size=None):
        """Draw, or take the next of the given parameters."""
        n = 1 if size is None else size
        v = self.drawn.uniform(lo, hi, n) if self.given is None else np.array([self.given.pop(0) for _ in range(n)])
        self.ranges += [(lo, hi)] * n
        self.values += v.tolist()
        return float(v[0]) if size is None else v


def parameters(name: str, seed: int) -> Parameters:
    """Parameters of a device that `draw` makes."""
    drawn = Parameters(np.random.default_rng([seed, list(DEVICES).index(name)]))
    DEVICES[name](drawn)
    return drawn


def played(run: Run, data: hy.Dataset) -> np.ndarray:
    """Output (n,) of a device over the records of the data, each from rest."""
    rows = np.column_stack([data.u, data.covariates.values])
    return data.along(lambda x: run(x[:, 0], x[:, 1:]), inputs=rows)


def by_graph(name: str, seed: int, data: hy.Dataset) -> hy.Model:
    """Model of the true structure as a graph of blocks."""
    graph, free = GRAPHS[name](*parameters(name, seed).values)
    return hy.fit(data, graph, free=free, starts=1)


def by_solver(name: str, seed: int, data: hy.Dataset) -> Run:
    """Device of the class whose own solver is fitted to the data."""
    drawn = parameters(name, seed)
    lo, hi = np.array(drawn.ranges).T

    def run(x):
        return DEVICES[name](Parameters(None, lo + (x - 1) * (hi - lo))).run

    start = 1 + (np.array(drawn.values) - lo) / (hi - lo)  # from 1 to 2: differences are steps of a range
    with np.errstate(all="ignore"):  # a step too far is not finite, and the search takes a shorter one
        found = least_squares(lambda x: played(run(x), data) - data.y, start, diff_step=1e-5, max_nfev=20)
    return run(found.x)
