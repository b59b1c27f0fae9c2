"""Linear plants in series with a compensated hysteresis, and the set of plants that agree with a record.

A plant is the sum of second-order modes and a static part c. The total static gain is 1. The input is a delayed command
that is constant over each step:

    G(s) = e^(-s tau) (c + sum_i k_i / (1 + 2 zeta_i s / w_i + s^2 / w_i^2)),  c + sum_i k_i = 1.

The set contains the identified plant, and plants with modes and delay at the ends of their confidence intervals. It
also contains plants with an additional resonance that the record did not excite. The frequency of this resonance may
have any value above the band in which input and output are coherent. A loop is designed for all plants of the set, and
for every incremental gain of inverse and plant in a sector.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from hystfmu.base import Array, Complex

UNSEEN_ZETA = 0.01  # damping ratio of a resonance that the record did not excite
# fraction of the static gain in this resonance if a mode is identified; otherwise the fraction is 1
UNSEEN_SHARE = 0.05
PER_DECADE = 28  # number of frequencies of this resonance in a decade
# highest frequency of this resonance over half the sampling rate; a held command hardly excites a higher one
BEYOND = 4.0
SIGMAS = 2.5  # half-width of the confidence intervals in standard errors
LEAST_SPREAD = 0.01  # smallest relative half-width for a natural frequency, which changes with load and temperature
LESS_DAMPED = 0.7  # factor of the damping, for the same reason
LATER = (0.0, 0.5, 1.0)  # additional delays (steps)
POINTS = 160  # number of angles for each plant
# distances of angles from a resonance, in half-widths
WIDTHS = np.sinh(np.linspace(-np.arcsinh(40.0), np.arcsinh(40.0), 33))


@dataclass(frozen=True)
class Plant:
    """A linear plant with static gain 1."""

    f_n: tuple[float, ...] = ()  # natural frequencies (Hz), damping ratios and static gains of the modes
    zeta: tuple[float, ...] = ()
    share: tuple[float, ...] = ()
    delay: float = 0.0  # delay behind the held command (s)
    name: str = "identified"  # text on the difference from the identified plant

    @property
    def rest(self) -> float:
        """Static gain of the part without dynamics (c in the equation of the module)."""
        return 1.0 - sum(self.share)

    def response(self, z: Complex, h: float) -> Complex:
        """Return the exact response at z, shape (m,), to a command that is constant over each step h (s).

        Each pole p of a partial fraction is discretised for the delayed hold by the modified z-transform (Astrom &
        Wittenmark, Computer-Controlled Systems, 3rd ed., section 2.3).
        """
        m, part = _steps(self.delay, h)
        found = self.rest * z ** -(1.0 + m)  # the static part passes the command that was held just before the sample
        late = z ** (-float(m))
        for f, zeta, k in zip(self.f_n, self.zeta, self.share, strict=True):
            for p, c in _poles(f, zeta):
                new, old = np.expm1(p * (1 - part) * h) / p, np.exp(p * (1 - part) * h) * np.expm1(p * part * h) / p
                found = found + k * c * late * (new + old / z) / (z - np.exp(p * h))
        return np.asarray(found)


def _steps(delay: float, h: float) -> tuple[int, float]:
    """Return the number of whole steps in a delay, and the remaining fraction of a step."""
    steps = delay / h
    whole = int(np.floor(steps + 1e-9))
    part = steps - whole
    return whole, part if part > 1e-9 else 0.0


def _poles(f: float, zeta: float) -> list[tuple[complex, complex]]:
    """Return poles and residues of 1 / (1 + 2 zeta s / w + s^2 / w^2)."""
    w = 2 * np.pi * f
    if abs(zeta - 1) < 1e-6:
        zeta = 1 + 1e-6  # for two equal poles, the residues are not defined
    root = np.sqrt(complex(zeta * zeta - 1))
    p, q = w * (-zeta + root), w * (-zeta - root)
    return [(p, w * w / (p - q)), (q, w * w / (q - p))]


@dataclass(frozen=True)
class Unseen:
    """A resonance that the record did not excite."""

    above: float  # lowest possible frequency (Hz)
    share: float = 1.0  # fraction of the static gain in the resonance
    zeta: float = UNSEEN_ZETA  # damping ratio of the resonance
    to: float | None = None  # highest possible frequency (Hz); None for `BEYOND` times half the sampling rate

    def added(self, plant: Plant, f: float, delay: float, name: str) -> Plant:
        """Return a plant with this resonance at f (Hz) in addition, and with the given delay (s) and name."""
        share = (*(k * (1 - self.share) for k in plant.share), self.share)
        return Plant((*plant.f_n, f), (*plant.zeta, self.zeta), share, delay, name)

    def frequencies(self, h: float) -> Array:
        """Return the frequencies of this resonance in the set of plants (Hz), shape (m,)."""
        last = BEYOND / (2 * h) if self.to is None else self.to
        if last <= self.above:
            return np.array([self.above])
        return np.geomspace(self.above, last, max(2, int(np.ceil(PER_DECADE * np.log10(last / self.above)))))


@dataclass(frozen=True)
class PlantSet:
    """Plants that agree with a record, and the frequency responses of these plants."""

    h: float  # step of the controller (s)
    plants: tuple[Plant, ...]  # the identified plant is first. The delays include the computing time.
    slopes: tuple[float, float]  # sector of the incremental gain
    angles: Array = field(repr=False)  # angles omega h in (0, pi] for each plant, in ascending order, shape (m, k)
    response: Complex = field(repr=False)  # response of each plant at its angles, shape (m, k)
    # expected devices: pairs of the identified plant with one parameter increased and decreased by a standard error
    beside: tuple[tuple[Plant, Plant], ...] = ()

    def missed(self, z: Complex) -> Array:
        """Return the expected value of abs(1 - G'/G)^2 at z, shape (m,).

        1 - G'/G is the relative error if a feed-forward that is designed for the identified plant G drives a device G'.
        """
        G = self.plants[0].response(z, self.h)
        total = np.zeros(len(z))
        for pair in self.beside:
            total += np.mean([np.abs(1 - p.response(z, self.h) / G) ** 2 for p in pair], axis=0)
        return total

    @property
    def z(self) -> Complex:
        """Points e^(j omega h) on the unit circle for each of the m plants, shape (m, k)."""
        return np.asarray(np.exp(1j * self.angles))


def plant_set(
    identified: Plant,
    h: float,
    slopes: tuple[float, float],
    *,
    errors: Sequence[tuple[float, float, float]] = (),
    delay_error: float = 0.0,
    unseen: Unseen | None = None,
    computing: float = 1.0,
) -> PlantSet:
    """Build the set of plants that agree with a record.

    Parameters
    ----------
    identified : Plant
        Identified plant without the computing time.
    h, slopes, unseen
        See `PlantSet`. `unseen` is a possible resonance in addition to the identified modes, see `Unseen`.
    errors, delay_error
        Standard errors of f_n (Hz), zeta and static gain of each mode, and standard error of the delay (s).
    computing : float
        Computing time between a sample and the resulting command (steps).
    """
    late = replace(identified, delay=identified.delay + computing * h)
    plants = [late, *_differing(late, errors, delay_error, h)]
    if unseen is not None:
        for f, more in product(unseen.frequencies(h), (LATER[0], LATER[-1])):
            name = f"a resonance at {f:.3g} Hz that the record did not excite" + _later(more)
            delay = late.delay + more * h + (SIGMAS * delay_error if more else 0.0)
            plants.append(unseen.added(late, float(f), delay, name))
    angles = np.array([_angles(p, h) for p in plants])
    response = np.array([p.response(np.exp(1j * a), h) for p, a in zip(plants, angles, strict=True)])
    return PlantSet(h, tuple(plants), slopes, angles, response, tuple(_beside(late, errors, delay_error, h)))


def _beside(
    p: Plant, errors: Sequence[tuple[float, float, float]], delay_error: float, h: float
) -> Iterator[tuple[Plant, Plant]]:
    for i, (f_se, zeta_se, _) in enumerate(errors):
        f, zeta = (
            [tuple(v + s * e * (j == i) for j, v in enumerate(values)) for s in (-1, 1)]
            for values, e in ((p.f_n, f_se), (p.zeta, zeta_se))
        )
        yield replace(p, f_n=f[0]), replace(p, f_n=f[1])
        yield replace(p, zeta=tuple(max(z, 1e-6) for z in zeta[0])), replace(p, zeta=zeta[1])
    late = min(delay_error, h)
    yield replace(p, delay=max(p.delay - late, 0.0)), replace(p, delay=p.delay + late)


def _differing(p: Plant, errors: Sequence[tuple[float, float, float]], delay_error: float, h: float) -> Iterator[Plant]:
    """Yield plants with other natural frequencies, less damping or more delay, within the uncertainty of the record."""
    sides = (-1.0, 0.0, 1.0) if p.f_n else (0.0,)
    for side, damping, more in product(sides, (1.0, LESS_DAMPED) if p.f_n else (1.0,), LATER):
        if side == 0 and damping == 1 and more == 0:
            continue
        f_n, zeta = [], []
        for (f, d, _), (f_se, d_se, _) in zip(zip(p.f_n, p.zeta, p.share, strict=True), errors, strict=True):
            f_n.append(f + side * max(SIGMAS * f_se, LEAST_SPREAD * f))
            zeta.append(min(damping * d, max(d - SIGMAS * d_se, 0.2 * d)) if damping != 1 else d)
        told = f"modes {100 * (f_n[0] / p.f_n[0] - 1):+.1f} %" * bool(side) if f_n else ""
        words = [w for w in (told, "less damped" * (damping != 1)) if w]
        late = p.delay + more * h + (SIGMAS * delay_error if more else 0.0)
        yield replace(p, f_n=tuple(f_n), zeta=tuple(zeta), delay=late, name=", ".join(words) + _later(more))


def _later(more: float) -> str:
    return f", {more:g} step later" if more else ""


def _angles(p: Plant, h: float) -> Array:
    """Return `POINTS` angles omega h that resolve all resonances of a plant.

    A resonance above half the sampling rate is resolved at the lower frequency (alias) to which sampling maps it.
    """
    at, width = [], []
    for f, zeta in zip(p.f_n, p.zeta, strict=True):
        turn = 2 * np.pi * f * h
        # sampling maps a mode above half the sampling rate to a lower frequency (alias)
        at.append(abs((turn + np.pi) % (2 * np.pi) - np.pi))
        width.append(zeta * turn)
    fine = np.concatenate([a + w * WIDTHS for a, w in zip(at, width, strict=True)]) if at else np.zeros(0)
    fine = fine[(fine > 1e-6) & (fine <= np.pi)]
    if len(fine) > POINTS // 2:
        fine = fine[:: -(-len(fine) // (POINTS // 2))]
    return np.sort(np.concatenate([fine, np.geomspace(1e-5, 1.0, POINTS - len(fine)) * np.pi]))
