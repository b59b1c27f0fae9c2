"""Comparison of controller structures on one set of plants, each tuned under the same limits.

For every structure, a search varies all values except the integral gain. For each set of values, it tries the largest
integral gain that meets the limits, and fractions of this gain. The search minimises the RMS error that the
disturbances in `Aim` cause. These disturbances are the model error at the harmonics of the references, the error of the
feed-forward, and the noise.

A loop meets the limits if the peak of the sensitivity is at most `ms_db` for the identified plant, and at most
`set_ms_db` for every plant of the set and every incremental gain in the sector. A limit of the peak Ms implies lower
bounds of all margins: gain margins of Ms / (Ms -+ 1) and a phase margin of 2 asin(1 / (2 Ms)) (Skogestad &
Postlethwaite, 2nd ed., section 2.4.3).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hystfmu.base import Array, Complex, Mask
from hystfmu.design.loop import Margins, margins_of
from hystfmu.design.plants import PlantSet
from hystfmu.design.structures import STRUCTURES, Design, Structure

MS_DB, SET_MS_DB = 6.0, 12.0
HALVINGS = 14
LEAST, MOST = 1e-7, 2.0  # range of the integral gain times the step
SLOWER = (1.0, 0.7, 0.5, 0.35, 0.2, 0.1, 0.05)  # fractions of the largest gain; a smaller gain causes less noise
# the search evaluates points of a low-discrepancy sequence, then steps of the Nelder-Mead simplex
DRAWS, STEPS = 32, 70
GRIDDED = 0.1  # reserve for a higher peak between two angles of the grid (dB)
WHITE = 200  # number of equidistant angles for white noise
TOO_SLOW = 1e3  # penalty factor of the error of a loop whose bandwidth is below the limit
EQUAL = 1.05  # the error of a more complex structure must be smaller by this factor


@dataclass(frozen=True)
class Limits:
    """Limits of a tuned loop.

    A loop that violates a limit of the peak is excluded. For a loop with a bandwidth below `bandwidth`, the error is
    multiplied by a penalty factor.
    """

    ms_db: float = MS_DB  # largest allowed peak of the sensitivity with the identified plant (dB)
    # largest allowed peak of the sensitivity with every plant of the set (dB)
    set_ms_db: float = SET_MS_DB
    bandwidth: float = 0.0  # required bandwidth (Hz), up to which the sensitivity is below -3 dB


@dataclass(frozen=True)
class Aim:
    """Powers of the disturbances of a loop at k frequencies, in the square of the unit of measure of the output."""

    f: Array  # Hz
    power: Array  # power of the model error at the input of the dynamics
    # power of the references. If a device differs from the plant, the feed-forward does not cancel all of it.
    reference: Array
    noise: float = 0.0  # RMS of the white noise of the sensor


@dataclass(frozen=True)
class Tuned:
    """A structure with its tuned gains, and the properties of the resulting loop."""

    structure: Structure
    design: Design
    values: dict[str, float]
    Ki: float  # integral gain (1/s)
    error: float  # expected RMS error, in the unit of measure of the output
    ms_db: float  # peak of the sensitivity (dB)
    set_ms_db: float
    worst: str  # name of the plant of the set with the largest peak
    bandwidth: float  # bandwidth (Hz), up to which the sensitivity is below -3 dB
    noise_gain: float  # RMS of the output for white noise of RMS 1 at the sensor
    margins: Margins  # margins with the identified plant

    @property
    def Kp(self) -> float:
        """Proportional gain."""
        return self.Ki * self.values["T"] if self.structure.proportional else 0.0


@dataclass(frozen=True)
class Race:
    """Result of the comparison: structures that meet the limits, best first, and reasons why the others do not."""

    found: tuple[Tuned, ...]
    refused: dict[str, str] = field(default_factory=dict)

    @property
    def winner(self) -> Tuned | None:
        """Return the best structure; None if no structure meets the limits."""
        return self.found[0] if self.found else None


def race(
    plants: PlantSet, design: Design, aim: Aim, limits: Limits = Limits(), names: Sequence[str] = tuple(STRUCTURES)
) -> Race:
    """Tune the controller structures in `names` for a set of plants, and sort them by their expected RMS error.

    `design` contains the identified plant and the step. `aim` contains the disturbances, and `limits` the limits of the
    loop.
    """
    found: list[Tuned] = []
    refused: dict[str, str] = {}
    for name in names:
        structure = STRUCTURES[name]
        if structure.resonant and not any(f * design.h < 0.4 for f in design.plant.f_n):
            refused[name] = f"no mode is known below {0.4 / design.h:.3g} Hz, 0.4 of the sampling rate"
            continue
        tuned = tune(structure, plants, design, aim, limits)
        if tuned is None:
            refused[name] = f"no gain keeps Ms below {limits.ms_db:g} dB, and {limits.set_ms_db:g} dB over the set"
        else:
            found.append(tuned)
    # the table begins with the simplest structure; a later structure must be clearly better
    ordered: list[Tuned] = []
    left = list(found)
    while left:
        wide = [t for t in left if t.bandwidth >= limits.bandwidth]
        least = min(t.error for t in wide or left)
        best = next(t for t in wide or left if t.error <= EQUAL * least)
        if not wide:
            best = max(left, key=lambda t: t.bandwidth)
        ordered.append(best)
        left.remove(best)
    return Race(tuple(ordered), refused)


def tune(structure: Structure, plants: PlantSet, design: Design, aim: Aim, limits: Limits) -> Tuned | None:
    """Tune one `structure` for a set of plants; return None if no gain meets the limits.

    The arguments `plants`, `design`, `aim` and `limits` are those of `race`.
    """
    # imported here, so that a process for a foreign FMU does not wait for the import
    from scipy.optimize import minimize
    from scipy.stats import qmc

    view = _View(plants, aim, limits)
    bounds = structure.bounds(design)
    names, ends = list(bounds), np.log(np.array(list(bounds.values())).reshape(-1, 2))

    def tried(x: Array) -> tuple[float, float, dict[str, float]]:
        x = np.clip(x, 0, 1)
        values = {
            n: float(f"{v:.4g}") for n, v in zip(names, np.exp(ends[:, 0] + x * np.ptp(ends, axis=1)), strict=True)
        }
        cost, Ki = view.best(structure, design, values)
        return cost, Ki, values

    if not names:
        _, Ki, values = tried(np.zeros(0))
        return view.figures(structure, design, values, Ki) if Ki else None
    points = qmc.Sobol(len(names), scramble=False).random(DRAWS)[1:]
    first = min(points, key=lambda x: tried(x)[0])
    if not np.isfinite(tried(first)[0]):
        return None
    simplex = np.vstack([first, first + 0.15 * np.diag(np.where(first < 0.5, 1.0, -1.0))])
    options: Any = {"maxfev": STEPS, "initial_simplex": simplex, "xatol": 1e-3, "fatol": 1e-4}

    def cost(x: Array) -> float:
        return float(np.log(tried(x)[0]))

    outcome = minimize(cost, first, method="Nelder-Mead", options=options)
    _, Ki, values = tried(np.asarray(outcome.x))
    return view.figures(structure, design, values, Ki) if Ki else None


class _View:
    """Data of the search: responses of a set of plants, and disturbances of the loop."""

    def __init__(self, plants: PlantSet, aim: Aim, limits: Limits) -> None:
        self.plants, self.aim, self.limits = plants, aim, limits
        self.z, self.G = plants.z, plants.response
        self.at = np.exp(2j * np.pi * aim.f * plants.h)
        # response of the identified plant at the frequencies of the disturbances
        self.low = plants.plants[0].response(self.at, plants.h)
        self.power = aim.power * np.abs(self.low) ** 2 + plants.missed(self.at) * aim.reference
        # angles of the noise, and the part of the spectrum that each represents; they resolve the resonances
        angles = np.union1d(np.pi * (np.arange(WHITE) + 0.5) / WHITE, plants.angles[0])
        self.parts = np.diff([0.0, *(angles[1:] + angles[:-1]) / 2, np.pi]) / np.pi
        self.wide = np.exp(1j * angles)
        self.G_wide = plants.plants[0].response(self.wide, plants.h)

    def best(self, structure: Structure, design: Design, values: Mapping[str, float]) -> tuple[float, float]:
        """Return the integral gain with the smallest expected RMS error for these values of a structure.

        Return this error (multiplied by the penalty factor) and the gain, or infinity and 0 if no gain meets the
        limits.
        """
        C = structure.response(design, values, self.z)
        lowest, highest = LEAST / self.plants.h, MOST / self.plants.h
        if not self.allowed(*C(lowest)):
            return np.inf, 0.0
        low, high = lowest, highest
        for _ in range(HALVINGS):
            middle = np.sqrt(low * high)
            low, high = (middle, high) if self.allowed(*C(middle)) else (low, middle)
        at, wide = (structure.response(design, values, z) for z in (self.at, self.wide))
        gains = [_rounded_down(share * low) for share in SLOWER]
        costs = [self.error(at(Ki)[0], wide(Ki)[0]) if Ki >= lowest else np.inf for Ki in gains]
        if self.limits.bandwidth:
            costs = [c * self.narrow(C(Ki)[0]) for c, Ki in zip(costs, gains, strict=True)]
        k = int(np.argmin(costs))
        return costs[k], gains[k]

    def allowed(self, C: Complex, inner: Complex | None) -> bool:
        """Return whether the controller C is stable, and the loops of C with all plants meet the limits of the peak."""
        if inner is not None and not unencircled(inner[:1]).all():
            return False
        X = C * self.G
        if np.abs(1 + X[0]).min() < 10 ** ((GRIDDED - self.limits.ms_db) / 20):
            return False
        if distances(X, self.plants.slopes).min() < 10 ** (-self.limits.set_ms_db / 20):
            return False
        return bool(unencircled(X).all())

    def narrow(self, C: Complex) -> float:
        """Return the factor by which the error is multiplied if the bandwidth is too small; 1 if it is sufficient."""
        missing = self.limits.bandwidth / max(self.bandwidth(C[0] * self.G[0]), 1e-9)
        return 1.0 if missing <= 1 else TOO_SLOW * missing**4

    def bandwidth(self, X: Complex) -> float:
        """Return the frequency up to which the sensitivity of the identified plant is below -3 dB (Hz)."""
        large = np.flatnonzero(np.abs(1 + X) < np.sqrt(2))
        return float(self.plants.angles[0][large[0]] / (2 * np.pi * self.plants.h)) if len(large) and large[0] else 0.0

    def error(self, C: Complex, C_wide: Complex) -> float:
        """Return the expected RMS error of the loop.

        Model error, uncertainty of the plant and sensor noise cause this error.
        """
        left = float((self.power / np.abs(1 + C * self.low) ** 2).sum())
        return float(np.sqrt(left + (self.aim.noise * self.noise_gain(C_wide)) ** 2))

    def noise_gain(self, C_wide: Complex) -> float:
        """Return the RMS of the output for white noise of RMS 1 at the sensor."""
        X = C_wide * self.G_wide
        return float(np.sqrt((self.parts * np.abs(X / (1 + X)) ** 2).sum()))

    def figures(self, structure: Structure, design: Design, values: dict[str, float], Ki: float) -> Tuned:
        """Return the structure with these values and the integral gain `Ki`, and the properties of its loop."""
        X = structure.response(design, values, self.z)(Ki)[0] * self.G
        at, wide = (structure.response(design, values, z)(Ki)[0] for z in (self.at, self.wide))
        near = distances(X, self.plants.slopes).min(axis=1)
        distance = np.abs(1 + X[0])
        return Tuned(
            structure,
            design,
            values,
            Ki,
            self.error(at, wide),
            float(-20 * np.log10(distance.min())),
            float(-20 * np.log10(near.min())),
            self.plants.plants[int(near.argmin())].name,
            self.bandwidth(X[0]),
            self.noise_gain(wide),
            self.margins(structure, design, values, Ki, X[0]),
        )

    def margins(
        self, structure: Structure, design: Design, values: Mapping[str, float], Ki: float, X: Complex
    ) -> Margins:
        """Return the stability margins of the loop with the identified plant."""
        plant, h = self.plants.plants[0], self.plants.h

        def L(angles: Array) -> Complex:
            z = np.exp(1j * angles)
            return np.asarray(structure.response(design, values, z)(Ki)[0] * plant.response(z, h))

        return margins_of(L, self.plants.angles[0], X, h, lambda gain: bool(unencircled(gain * X[None])[0]))


def distances(X: Complex, slopes: tuple[float, float]) -> Array:
    """Return the smallest distance of k X from -1 over all factors k in the sector `slopes`, for each element of X.

    k X lies on the straight line from slopes[0] X to slopes[1] X. The nearest point of this line has a closed form.
    """
    size = np.maximum(np.abs(X) ** 2, 1e-300)
    k = np.clip(-X.real / size, *slopes)
    return np.asarray(np.abs(1 + k * X))


def unencircled(X: Complex) -> Mask:
    """Return whether each closed loop with incremental gain 1 is stable (Nyquist criterion), shape (m,).

    The open loops have one integrator and no unstable pole. Therefore the Nyquist curve must not encircle -1. Along the
    upper half of the unit circle, 1 + X must end on the positive real axis without a turn around 0.
    """
    f = 1 + X
    turned = np.angle(f[:, 1:] / f[:, :-1]).sum(axis=1) + np.angle(f[:, 0])
    return np.asarray(np.abs(turned) < np.pi / 2)


def _rounded_down(x: float) -> float:
    """Return a positive number rounded down to three digits, so that the limits of the search still hold."""
    digits = int(np.floor(np.log10(x))) - 2
    unit = 10.0**digits
    return float(f"{np.floor(x / unit * (1 + 1e-12)) * unit:.3g}")
