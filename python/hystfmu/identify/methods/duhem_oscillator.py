"""Oscillator with a Duhem force of free shape, fitted to force and displacement, without the Bouc-Wen equation.

  m_L y'' + c_L y' + k_L y + z = u,   dz/dy = f(s z), s = sgn(y')

f is piecewise linear on equal knots and the same for both directions of motion (odd symmetry of the loop).  The linear
oscillator gives the first estimates; the output error of the free run from rest is then minimised by
Levenberg-Marquardt, on the first quarter of the train rows and on all of them.  Knots are added between the knots while
the data support them (Bayesian information criterion).

Guard: of two knots at -x and x, the stiffer one counts at -x, and none there is below `SOFTEST`.  Every loop of z over
y then takes energy from the motion, so that a free run of the equation decays, whatever the data.

Trap: the block interpolates u linearly between rows, and steps as long as the rows.  Force with power near the sample
rate must be given at a finer step (band-limited interpolation, option ``stride``).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output, Value
from hystfmu.identify.candidate import LAGS, Candidate
from hystfmu.identify.methods.bouc_wen_oscillator import linear_oscillator
from hystfmu.identify.options import Option
from hystfmu.identify.solvers.levenberg_marquardt import minimise

TEXT = "oscillator with a Duhem force of free shape, Levenberg-Marquardt on the free run"
KNOTS = (5, 9, 17)  # of f; the finer ones hold the coarser, and all hold 0, where f must be positive
ITERATIONS, TOLERANCE = 30, 1e-6  # limits of a search
STEP = 1e-4  # finite-difference step of a parameter scaled to about 1
SOFTEST = 1e-3  # of the first estimates: least mass, damping, stiffness
ROOM = 1.1  # z_max over the largest spring force: z is a part of that force, but keeps it after reversals
SHARES = (0.5, 0.25, 0.125)  # of this z_max: other starts, for a force that yields early

OPTIONS = (
    Option(
        "stride", 1, 1, 1000000, text="every stride-th train row counts: factor by which the data were interpolated"
    ),
)
CANDIDATES = (Candidate(LAGS, 0.5, 3.0),)


def build(data: Dataset, options: Mapping[str, Any], seed: int, progress: Callable[[float], None]) -> tuple[Graph, int]:
    """Build the graph of one ``duhem_oscillator``; return it and the number of its parameters.

    Raises
    ------
    InputError
        The spectra give a mass or stiffness that is not positive, a natural frequency above that of the rows, or an
        oscillator that has nothing to do with the data.
    """
    stride = options["stride"]
    rows = np.arange(len(data.u))[data.counted][::stride]
    y = data.y[rows]
    m, c, k = linear_oscillator(data.u[rows], y, data.h * stride)
    omega = np.sqrt(k / m) if m > 0 and k > 0 else np.nan
    if not omega * data.h * stride < np.pi:
        raise InputError(
            f"{data.path or data.name}: The linear oscillator of the data must have m_L > 0, k > 0 and sqrt(k/m_L) "
            f"below pi/h = {np.pi / (data.h * stride):.3g} 1/s. Got m_L = {m:g}, k = {k:g} instead."
        )
    widest = ROOM * k * float(np.abs(y).max())
    scale = (m, max(c, 0.01 * float(np.sqrt(m * k))), k)
    size = float(np.sqrt(np.mean(y**2)))

    def errors(p: Array, z_max: float, count: int) -> Array:
        model = graph(physical(p), (*scale, z_max), data)
        e = (model.run(data.u[: rows[count - 1] + 1], data.h)[rows[:count]] - y[:count]) / size
        return np.asarray(np.clip(np.nan_to_num(e, nan=1e3), -1e3, 1e3))  # a trial may diverge

    def function(p: Array, z_max: float, count: int) -> tuple[Array, Array]:
        e = errors(p, z_max, count)
        moved = p + STEP * np.eye(len(p))
        return e, np.column_stack([(errors(q, z_max, count) - e) / STEP for q in moved])

    def search(p: Array, z_max: float, count: int, done: float) -> Trial:
        p, cost = minimise(
            p,
            partial(function, z_max=z_max, count=count),
            ITERATIONS,
            TOLERANCE,
            lambda part: progress(done + part / 8),
            partial(errors, z_max=z_max, count=count),
        )
        return Trial(p, z_max, cost, count)

    first = np.concatenate([[1.0, 1.0, 0.5], np.linspace(0.8, 0.2, KNOTS[0])])
    quarter = len(y) // 4
    off = min(float(np.sqrt(np.mean(errors(first, s * widest, quarter) ** 2))) for s in (1.0, *SHARES))
    if off >= 1:  # a search from there wanders among stiff oscillators for minutes
        raise InputError(
            f"{data.path or data.name}: The linear oscillator of the data, from rest, must come closer to them than no "
            f"output at all. Got {off:.3g} times its RMS error: take another kind."
        )
    best = search(first, widest, quarter, 0.0)
    for i, share in enumerate(SHARES):
        trial = search(first, share * widest, quarter, (i + 1) / 8)
        best = trial if trial.beats(best) else best
    best = search(best.p, best.z_max, len(y), 4 / 8)
    for i, n in enumerate(KNOTS[1:]):
        f = np.interp(np.linspace(0, 1, n), np.linspace(0, 1, len(best.p) - 3), best.p[3:])
        trial = search(np.concatenate([best.p[:3], f]), best.z_max, len(y), (i + 5) / 8)
        if not trial.beats(best):
            break
        best = trial
    return graph(physical(best.p), (*scale, best.z_max), data), len(best.p)


@dataclass(frozen=True)
class Trial:
    """Result of a search: parameters, range of the knots, sum of squares over `count` rows."""

    p: Array
    z_max: float
    cost: float
    count: int

    def beats(self, other: Trial) -> bool:
        """Whether the data support this result rather than the other (Bayesian information criterion)."""
        more = max(len(self.p) - len(other.p), 1) * np.log(self.count)
        return bool(self.count * np.log(other.cost / max(self.cost, 1e-300)) > more)


def physical(p: Array) -> Array:
    """Return parameters (3 + n,), relative to the first estimates, of an oscillator whose force takes energy."""
    f = p[3:]
    left = np.maximum(np.maximum(f, f[::-1]), SOFTEST)
    right = np.minimum(f, f[::-1])
    first = np.arange(len(f)) < (len(f) + 1) // 2
    return np.concatenate([np.maximum(p[:3], SOFTEST), np.where(first, left, right)])


def graph(p: Array, scale: tuple[float, ...], data: Dataset) -> Graph:
    """Return the graph of the block with the parameters p times the first estimates of m_L, c_L, k_L; and z_max."""
    m, c, k, z_max = scale
    lead = {"m_L": m * float(p[0]), "c_L": c * float(p[1]), "k_L": k * float(p[2])}
    values: dict[str, Value] = {**lead, "f": k * p[3:], "z_max": z_max}
    node = Node("plant", "duhem_oscillator", {"n": len(p) - 3}, values)
    inputs = [Input("u", ("plant.u",), data.unit_u, float(data.u[0]))]
    return Graph([node], [], inputs, [Output("y", "plant.y", data.unit_y)])
