"""Oscillator with Maxwell-slip friction, fitted to a record of force u and displacement y.

  m_L y'' + c_L y' + k_L y + sum_i k_i s_i = +-(u - u_0),   s_i a stop of half-width r_i of y,   output y + y_0

(Lampaert, Al-Bender & Swevers 2003). The record starts at rest, with springs that are not deflected. The stops act on
the displacement, which the record contains. Therefore, for given half-widths r_i, the equation of motion is linear in
all other parameters. Non-negative least squares of this equation, filtered by a low-pass filter, selects springs from a
grid of half-widths; nearly all weights k_i are then 0. From these start values, the output error of a simulation from
rest is minimised over all parameters. Grids of several sizes are tried, and the Bayesian information criterion selects
one of the results.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hystfmu.base import Array, InputError, Progress
from hystfmu.data import Dataset
from hystfmu.graph import Node
from hystfmu.graph.recursion import discretised
from hystfmu.identify.catalogue import ANY, Built, Candidate, Options, Row, device, wired
from hystfmu.identify.estimate.objective import Linear, Objective, determined
from hystfmu.identify.features.plays import plays
from hystfmu.identify.solvers.nonnegative import nonnegative
from hystfmu.identify.solvers.trust_region import Coordinates, refined
from hystfmu.model import run_along

TEXT = "oscillator with Maxwell-slip friction, non-negative least squares, refined on the free run"
GRIDS = (12, 8, 17, 24)  # numbers of half-widths from which springs are selected
WIDTHS = (0.004, 0.45)  # smallest and largest half-width, relative to the span of y
CORNER, HIGHEST = 16.0, 0.25  # corner frequency of the filter: relative to the RMS frequency of u; limit in 1 / row
EVALUATIONS, TOLERANCE = 60, 1e-7  # limits of a search
POOR = 0.03  # RMS error, relative to the span of y, above which no further grid is tried
LEAST = 0.01  # smallest start value of the damping ratio, and of k_L relative to the stiffness of all springs
DOWN, UP = 6.0, (4.0, 6.0, 3.0)  # bounds of the logarithms of all parameters, and of m_L, c_L and stiffnesses


@dataclass(frozen=True)
class Springs:
    """Start values: the sign of u, the values of m_L, c_L, k_L and all k_i (3 + n,), the half-widths r (n,)."""

    sign: float
    stiff: Array
    r: Array

    def objective(self, data: Dataset) -> Objective:
        """Return the search of all parameters; its coordinates are their logarithms relative to the start values."""
        n = len(self.r)

        def values(p: Array) -> dict[str, ArrayLike]:
            q = np.concatenate([self.stiff, self.r]) * np.exp(p)
            found = {"m_L": q[0], "c_L": q[1], "k_L": q[2], "k": q[3 : 3 + n], "r": q[3 + n :]}
            return {f"plant.{name}": value for name, value in found.items()}

        most = np.concatenate([UP, np.full(n, UP[2]), np.log(np.ptp(data.y[data.counted]) / self.r)])
        nodes = [
            Node("input", "scaling", {"n": 1}, {"gain": self.sign, "offset": -self.sign * float(data.u[0])}),
            Node("plant", "maxwell_slip_oscillator", {"n": n}),
            Node("readout", "scaling", {"n": 1}),
        ]
        coordinates = Coordinates(np.full(len(most), -DOWN), most, np.full(len(most), 0.3), values)
        return Objective(data, device(data, nodes, wired(nodes)), coordinates, [Linear("readout.offset")])


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit a graph with one block ``maxwell_slip_oscillator``; return graph, number of parameters, further results.

    If the record shows no mass or no friction, an InputError is raised.
    """
    every, rows, results = np.arange(len(data.u)), data.counted, []
    gain = float(np.polyfit(data.u[rows], data.y[rows], 1)[0])
    beside = np.interp(every, every[rows], (data.y - gain * data.u)[rows])
    for i, count in enumerate(GRIDS):
        progress(i / len(GRIDS))
        y = gain * data.u + beside
        for known in (False, True):  # the first model replaces the output of held-out rows, before proportional to u
            objective = selected(data, y, count, known).objective(data)
            start = np.zeros(len(objective.coordinates.lo))
            y = run_along(objective.graph(start), data)
            y[rows] = data.y[rows]
        found = refined(objective, start, EVALUATIONS, TOLERANCE, by_jacobian=True)
        criterion = len(objective.y) * np.log(max(found.cost, 1e-300)) + len(start) * np.log(len(objective.y))
        results.append((criterion, objective, found.p))
        if found.misfit > POOR:
            break
    _, best, p = min(results, key=lambda result: result[0])
    return best.graph(p), len(p) + 1, {"free": determined(best, p).table}


def selected(data: Dataset, y: Array, count: int, known: bool) -> Springs:
    """Fit the filtered equation of motion to the displacement y (n,) with `count` half-widths; return the springs.

    If all stiffnesses of springs with a slider are 0, an InputError is raised. If the natural frequency is above pi/h,
    an InputError is raised too, unless held-out rows of y are not `known`; the mass is then increased to this limit.
    """
    rows, h, seen = data.counted, data.h, data.u[data.train]
    r = np.ptp(y[rows]) * np.geomspace(*WIDTHS, count)
    w = min(CORNER * float(np.std(np.diff(seen)) / np.std(seen)), 2 * np.pi * HIGHEST) / h
    butterworth = [1 / w**3, 2 / w**2, 2 / w, 1.0]

    def filtered(power: int, x: Array) -> Array:
        b = np.eye(power + 1)[0]
        low = Node("low", "transfer_function", {}, {"b": b, "a": butterworth, "hold": "foh", "start": "steady"})
        return data.along(discretised(low, h).run, inputs=x)[rows]

    deflections = data.along(lambda y: y[:, None] - plays(y, r, y[0]), inputs=y)
    of_y = [filtered(power, y[:, None]) for power in (2, 1, 0)]
    force = filtered(0, data.u[:, None])[:, 0]
    sign = 1.0 if np.cov(data.u[rows], y[rows])[0, 1] >= 0 else -1.0
    x, _ = nonnegative(np.column_stack([*of_y, filtered(0, deflections)]), sign * force, np.ones((len(force), 1)))
    (m, c, k), springs = x[:3], x[3:]
    most = k + springs.sum()
    least = most * (h / np.pi) ** 2
    if not springs.any() or (known and m <= least):
        raise InputError(
            f"{data.path or data.name}: The record must show a mass that is held by springs with sliders, with a "
            f"natural frequency below pi/h = {np.pi / h:.3g} 1/s. Got m_L = {m:g}, k_L = {k:g} and "
            f"{springs.sum():g} for the sum of k: take another kind."
        )
    m = max(m, least)
    lead = [m, max(c, 2 * LEAST * np.sqrt(m * most)), max(k, LEAST * most)]
    return Springs(sign, np.concatenate([lead, springs[springs > 0]]), r[springs > 0])


KINDS = {
    "maxwell_slip_oscillator": Row(TEXT, build, (), (Candidate(ANY, 0.3, 0.4),), records=True),
}
