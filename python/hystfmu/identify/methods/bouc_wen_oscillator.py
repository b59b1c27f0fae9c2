"""Oscillator with a Bouc-Wen force, fitted to a record of force u and displacement y.

  m_L y'' + c_L y' + k_L y + z = u,   z' = alpha y' - beta (gamma |y'| |z|^(nu-1) z + delta y' |z|^nu)

(Noel & Schoukens 2016, eq. 1-2). beta only scales gamma and delta. The condition |gamma| + |delta| = 1 removes this
redundancy. First, a linear oscillator is fitted to the spectra of u and y (Sanathanan & Koerner 1963). It gives the
mass, the damping, and the sum of the stiffnesses of spring and hysteresis. Then the output error of a simulation from
rest is minimised, with several start values for the shape of the loop.

Trap: the block interpolates u linearly between rows. If the force has high frequencies, it must be resampled to a finer
step by band-limited interpolation. With 5 rows per period of the fastest component, linear interpolation causes an
error of 7 % of the output. With 100 rows, the error is 0.03 %.
"""

from itertools import product

import numpy as np

from hystfmu.base import Array, InputError, Progress
from hystfmu.data import Dataset
from hystfmu.graph import Node
from hystfmu.identify.catalogue import LAGS, Built, Candidate, Option, Options, Row, device
from hystfmu.identify.estimate.objective import Objective, determined, search
from hystfmu.identify.solvers.trust_region import Coordinates

TEXT = "oscillator with a Bouc-Wen force as a grey box, nonlinear least squares"
EVALUATIONS = (8, 60)  # maximum number of evaluations of residuals and Jacobian: per start value, for the best one
SHARES, SHAPES = (0.3, 0.7), ((0.5, -0.5), (0.5, 0.5))  # start values: alpha / (k_L + alpha), and (gamma, delta)
SCALES = np.array([0.1, 0.3, 0.1, 0.1, 0.5, 0.5])

CANDIDATES = (Candidate(LAGS, 0.3, 0.3),)
OPTIONS = (
    Option("nu", 1.0, 1.0, 20.0, text="sharpness of the knee"),
    Option(
        "stride", 1, 1, 1000000, text="factor by which the record was interpolated; the fit uses one of stride rows"
    ),
)


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit a graph with one block ``bouc_wen_oscillator``; return graph, number of parameters, further results.

    If the linear oscillator has a mass or a stiffness that is not positive, an InputError is raised.
    """
    rows = np.arange(len(data.u))[data.counted][:: options["stride"]]
    y = data.y[rows]
    size = float(np.sqrt(np.mean(y**2))) * np.sqrt(len(y))
    m, c, k = linear_oscillator(data.u[data.train], data.y[data.train], data.h)
    if not (m > 0 and k > 0):
        raise InputError(
            f"{data.path or data.name}: The linear oscillator of the data must have m_L > 0 and k > 0. "
            f"Got m_L = {m:g}, k = {k:g} instead."
        )
    c = max(c, 0.01 * np.sqrt(m * k))
    force = k * float(np.sqrt(np.mean(y**2)))  # RMS of z if the hysteresis had the whole stiffness

    def values(p: Array) -> dict[str, float]:
        # gamma and delta times beta, relative to the rate at which a force of this size would saturate
        shape = p[4:6] * k / (force ** options["nu"])
        beta = float(np.abs(shape).sum()) or 1.0
        lead = dict(zip(("m_L", "c_L", "k_L", "alpha"), np.array([m, c, k, k]) * np.exp(p[:4]), strict=True))
        found = {**lead, "beta": beta, "gamma": shape[0] / beta, "delta": shape[1] / beta}
        return {f"plant.{name}": float(value) for name, value in found.items()}

    bound = np.array([3.0, 6.0, 6.0, 6.0, 50.0, 50.0])
    plant = Node("plant", "bouc_wen_oscillator", {}, {"nu": options["nu"]})
    start = device(data, [plant], [], ["plant.u"], "plant.y")
    objective = Objective(data, start, Coordinates(-bound, bound, SCALES, values), size=size, rows=rows)
    starts = [
        np.array([0.0, 0.0, np.log(1 - share), np.log(share), *np.asarray(shape) / share ** options["nu"]])
        for share, shape in product(SHARES, SHAPES)
    ]
    p = search(objective, starts, progress, EVALUATIONS).p
    names = ("ln m_L", "ln c_L", "ln k_L", "ln alpha", "gamma", "delta")  # over their first estimates
    limits = zip(names, p.tolist(), (-bound).tolist(), bound.tolist(), strict=True)
    bounded = {name: tuple(of) for name, *of in limits}
    return objective.graph(p), len(p), {"bounded": bounded, "free": determined(objective, p).table}


def linear_oscillator(u: Array, y: Array, h: float) -> tuple[float, float, float]:
    """Return the mass, damping and stiffness of (m s^2 + c s + k) Y = U, fitted at the excited frequencies.

    The force u and the displacement y (n,), with the step h (s), must contain whole periods, or must be much longer
    than the decay time of the oscillator. Each of the 10 iterations weights the equation by 1/|m s^2 + c s + k|
    with the values of the previous iteration. Therefore the output error is minimised instead of the equation error.
    The result is in the units of measure of u, y and s.
    """
    U, Y = np.fft.rfft(u - u.mean()), np.fft.rfft(y)  # frequency 0, with the mean of y, is then not excited
    lines = np.abs(U) > 0.1 * np.abs(U).max()
    s = 2j * np.pi * np.fft.rfftfreq(len(u), h)[lines]
    U, Y = U[lines], Y[lines]
    powers = np.column_stack([s**2, s, np.ones_like(s)])
    scale = np.abs(s).max() ** np.array([2.0, 1.0, 0.0])  # equalises the columns: s^2 is about 1e6 times 1
    weight = np.ones(len(s))
    x = np.zeros(3)
    for _ in range(10):
        A, b = powers / scale * (Y * weight)[:, None], U * weight
        x = np.linalg.lstsq(np.vstack([A.real, A.imag]), np.concatenate([b.real, b.imag]), rcond=None)[0] / scale
        weight = 1 / np.maximum(np.abs(powers @ x), 1e-300)
    return float(x[0]), float(x[1]), float(x[2])


KINDS = {"bouc_wen_oscillator": Row(TEXT, build, OPTIONS, CANDIDATES)}
