"""Oscillator with a Duhem force whose shape is a free function, fitted to a record of force u and displacement y.

  m_L y'' + c_L y' + k_L y + z = u,   dz/dy = f(s z), s = sgn(y')

f is piecewise linear with equally spaced knots. It is the same for both directions of motion, so the loop has odd
symmetry. A linear oscillator gives the first estimates. Then the output error of a simulation from rest is minimised,
first on the first quarter of the training rows, and then on all training rows. The number of knots is increased while
the data support this (Bayesian information criterion).

Constraint: for knots at -x and x (x > 0), the stiffness at -x is at least the stiffness at x, and at least `SOFTEST`.
Then every loop of z over y dissipates energy, so the free motion of the model decays.

Trap: the block interpolates u linearly between rows and makes one step per row. If the force has high frequencies, it
must be resampled to a finer step by band-limited interpolation (option ``stride``).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hystfmu.base import Array, InputError, Progress
from hystfmu.data import Dataset
from hystfmu.graph import Node
from hystfmu.identify.catalogue import LAGS, Built, Candidate, Option, Options, Row, device
from hystfmu.identify.estimate.objective import Objective, determined
from hystfmu.identify.methods.bouc_wen_oscillator import linear_oscillator
from hystfmu.identify.solvers.trust_region import Coordinates, refined

TEXT = "oscillator with a Duhem force of free shape, least squares on the free run"
KNOTS = (5, 9, 17)  # numbers of knots of f; a finer grid contains the knots of the coarser grid, and 0 is a knot
EVALUATIONS, TOLERANCE = 30, 1e-6  # limits of a search
SOFTEST = 1e-3  # smallest mass, damping and stiffness, relative to the first estimates
ROOM = 1.1  # z_max relative to the largest spring force of the linear oscillator
SHARES = (0.5, 0.25, 0.125)  # further start values of z_max, relative to the first one

OPTIONS = (
    Option(
        "stride", 1, 1, 1000000, text="factor by which the record was interpolated; the fit uses one of stride rows"
    ),
)
CANDIDATES = (Candidate(LAGS, 0.5, 3.0),)


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit a graph with one block ``duhem_oscillator``; return graph, number of parameters, further results.

    An InputError is raised if the spectra give a mass or stiffness that is not positive, if the natural frequency is
    above pi/h, or if the first estimates have a larger error than an output of 0.
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
    damping = max(c, 0.01 * float(np.sqrt(m * k)))
    size = float(np.sqrt(np.mean(y**2)))

    def objective(z_max: float, count: int, knots: int) -> Objective:
        """Return the objective of the search on the first `count` rows, for a force with `knots` knots."""

        def values(p: Array) -> dict[str, ArrayLike]:
            q = physical(p)
            return {"plant.m_L": m * q[0], "plant.c_L": damping * q[1], "plant.k_L": k * q[2], "plant.f": k * q[3:]}

        n = 3 + knots
        c = Coordinates(np.full(n, -np.inf), np.full(n, np.inf), np.ones(n), values)
        plant = Node("plant", "duhem_oscillator", {"n": knots}, {"z_max": z_max})
        graph = device(data, [plant], [], ["plant.u"], "plant.y")
        return Objective(data, graph, c, size=size * np.sqrt(count), rows=rows[:count])

    def search(p: Array, z_max: float, count: int, done: float) -> Trial:
        progress(done)
        found = refined(objective(z_max, count, len(p) - 3), p, EVALUATIONS, TOLERANCE, by_jacobian=True)
        return Trial(found.p, z_max, found.cost, count)

    first = np.concatenate([[1.0, 1.0, 0.5], np.linspace(0.8, 0.2, KNOTS[0])])
    quarter = len(y) // 4
    off = min(float(np.linalg.norm(objective(s * widest, quarter, KNOTS[0]).residuals(first))) for s in (1.0, *SHARES))
    if off >= 1:  # from such a start, a search takes minutes and ends at stiff oscillators
        raise InputError(
            f"{data.path or data.name}: The RMS error of the linear oscillator from rest must be below that of the "
            f"output 0. Got {off:.3g} times this error: choose another kind."
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
    fitted = objective(best.z_max, len(y), len(best.p) - 3)
    return fitted.graph(best.p), len(best.p), {"free": determined(fitted, best.p).table}


@dataclass(frozen=True)
class Trial:
    """Result of a search: parameters p, and range z_max of the knots.

    `cost` is half the sum of squared residuals on `count` rows.
    """

    p: Array
    z_max: float
    cost: float
    count: int

    def beats(self, other: "Trial") -> bool:
        """Return whether this result is better than the other by the Bayesian information criterion."""
        more = max(len(self.p) - len(other.p), 1) * np.log(self.count)
        return bool(self.count * np.log(other.cost / max(self.cost, 1e-300)) > more)


def physical(p: Array) -> Array:
    """Return the parameters p (3 + n,), changed so that they satisfy the constraint of the module docstring.

    All parameters are relative to the first estimates.
    """
    f = p[3:]
    left = np.maximum(np.maximum(f, f[::-1]), SOFTEST)
    right = np.minimum(f, f[::-1])
    first = np.arange(len(f)) < (len(f) + 1) // 2
    return np.concatenate([np.maximum(p[:3], SOFTEST), np.where(first, left, right)])


KINDS = {"duhem_oscillator": Row(TEXT, build, OPTIONS, CANDIDATES)}
