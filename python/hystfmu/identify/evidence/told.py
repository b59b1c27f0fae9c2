"""Evidence from a fit: prepared records, known modes, standard errors, the delay, and the noise of the sensor."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.identify.evidence.found import Mode
from hystfmu.identify.evidence.lag import prepared
from hystfmu.identify.evidence.modal_fit import LEAST_ZETA, MOST_ZETA, Fitted, Problem
from hystfmu.identify.evidence.spectra import CELL, LOCAL, Cells, Response, Window, noise_density, quiet_density, smooth

INEXACT = 0.01  # of the output in a cell: error of the model of the hysteresis and of the input between rows
BEYOND = 1.15  # last bin of a fit, over the highest frequency that is seen
KNOWN_F, KNOWN_ZETA, KNOWN_SHARE = 0.1, 0.5, 1 / 5  # largest relative standard errors of a mode
KNOWN_TOLD = 0.5  # the same of its share, with the errors of its shape
HIGHEST = 0.35  # frequency of a mode over the sample rate
OVERDAMPED = 0.5  # damping ratio from which a part below the modes is creep, and one of negative share none
REST_SHAPE = 0.5  # share of a rest that may be the rise of its mode towards its resonance
BENT = 0.5  # error of f_n over the half width of the resonance, for an error of the response there
LEAST_F, LEAST_ZETA_SE, LEAST_SHARE, LEAST_DELAY = 1e-4, 3e-3, 2e-3, 0.05
"""Least standard errors: relative errors of f_n and zeta, error of a share, and error of the delay in steps.

Tests with drawn devices show errors of this size even if the noise allows smaller errors. Modes above the band, and
inputs that are not ramps between rows, cause these errors.
"""


@dataclass(frozen=True)
class Seen:
    """Input and output, each divided by its span, with the spectra of the records."""

    h: float
    v: Array
    y: Array
    records: tuple[slice, ...]
    windows: tuple[Window, ...]
    cells: Cells
    response: Response


def problem_of(seen: Seen, hold: str, noise: Array, lowest: float, highest: float, slow: tuple[float, ...]) -> Problem:
    """Return the problem of a fit to the bins from `lowest` to above `highest` (Hz), with the noise of each cell."""
    bins = []
    for w in seen.windows:
        f = w.frequencies(seen.h)
        bins.append(slice(int(np.searchsorted(f, lowest)), int(np.searchsorted(f, highest * BEYOND, "right"))))
    v = held_input(seen, hold)
    p = Problem(seen.h, hold, v, seen.y, seen.records, seen.windows, bins, np.zeros(0), slow)
    return replace(p, weight=weight_of(seen, p, noise))


def held_input(seen: Seen, hold: str) -> Array:
    """Return the input (n,) whose ramps or steps represent the input between rows."""
    return np.concatenate([prepared(seen.v[r], hold) for r in seen.records])


def weight_of(seen: Seen, problem: Problem, noise: Array) -> Array:
    """Return 1 / RMS of noise and model error, for each bin that the fit uses."""
    both = np.repeat(noise + INEXACT**2 * seen.cells.total / CELL, CELL)
    out, at = [], 0
    for w, b in zip(seen.windows, problem.bins, strict=True):
        size = w.cells * CELL
        out.append(both[at : at + size][b])
        at += size
    return np.asarray(1 / np.sqrt(np.concatenate(out)))


def left_over(seen: Seen, hold: str, found: Fitted) -> Array:
    """Return the measured output (n,) minus the output of a fit."""
    problem = Problem(seen.h, hold, held_input(seen, hold), seen.y, seen.records, (), (), np.zeros(0), ())
    return np.asarray(seen.y - found.output(problem))


def powers(seen: Seen, e: Array) -> Array:
    """Return the mean power of a signal (n,) in each cell."""
    return np.concatenate([(np.abs(w.transform(e)) ** 2).reshape(-1, CELL).mean(axis=1) for w in seen.windows])


def noise_of(seen: Seen, e: Array) -> Array:
    """Return the noise of each cell: the smaller residual, either of a fit or of the local response.

    With a lightly damped resonance the response is curved within a cell.
    """
    left, at, power = [], 0, powers(seen, e)
    for w in seen.windows:
        left.append(smooth(power[at : at + w.cells]))
        at += w.cells
    return np.minimum(seen.cells.noise, np.concatenate(left))


def known_modes(found: Fitted, seen: Seen) -> NDArray[np.bool_]:
    """Return which modes the record determines, by standard errors, bounds, and the excitation around each mode."""
    r = seen.response
    sd = np.sqrt(np.diag(found.covariance))
    known = np.zeros(found.structure.modes, dtype=bool)
    for k in range(found.structure.modes):
        f_n, zeta = np.exp(found.p[2 * k : 2 * k + 2])
        near = (r.f > f_n / 2 ** (1 / 3)) & (r.f < f_n * 2 ** (1 / 6))
        known[k] = (
            sd[2 * k] < KNOWN_F
            and sd[2 * k + 1] < KNOWN_ZETA
            and f_n < HIGHEST / seen.h
            and LEAST_ZETA * 1.05 < zeta < MOST_ZETA / 1.05
            and sd[len(found.p) + k] < KNOWN_SHARE * abs(found.gain[k])
            and near.any()
            and np.mean(r.seen[near]) > 0.5
        )
    return known


def density_of(seen: Seen, e: Array) -> float:
    """Return the noise density in spans of y.

    It is the least residual of local responses, of a fit, and of rows at rest.
    """
    left = seen.cells.left / (CELL - LOCAL)
    return min(
        noise_density(left, 2 * (CELL - LOCAL), seen.cells.f, seen.h),
        noise_density(powers(seen, e), 2 * CELL, seen.cells.f, seen.h),
        quiet_density([e[w.rows] for w in seen.windows], seen.h),
    )


def static_gain(r: Response, found: Fitted | None) -> float:
    """Return the static gain of a fit; without a fit, the median gain of the lowest third of coherent points."""
    if found is not None and found.structure.modes:
        return abs(float(found.gain.sum())) or 1.0
    seen = np.flatnonzero(r.seen)
    return float(np.median(np.abs(r.g[seen[: max(len(seen) // 3, 1)]]))) or 1.0 if len(seen) else 1.0


def told(found: Fitted | None, seen: Seen, e: Array, density: float) -> tuple[tuple[Mode, ...], float, float]:
    """Return the known modes, sorted by frequency, and the delay with its standard error (s).

    e (n,) is the residual of the fit; `density` is the density of the noise in spans of y.
    """
    h = seen.h
    if found is None:
        return (), 0.0, float("inf")
    m, known = len(found.p), known_modes(found, seen)
    f_n, zeta = np.exp(found.p[: m - 1 : 2]), np.exp(found.p[1 : m - 1 : 2])
    # creep is no part of the static gain of the dynamics
    slow = ~known & (zeta > OVERDAMPED) & (f_n < np.min(f_n[known], initial=np.inf))
    counted = np.append(~slow, found.structure.rest)[: len(found.gain)].astype(bool)
    total = float(found.gain[counted].sum()) or 1.0
    # a rest is a mode above the band, which is larger there than at rest, and so is a mode that is not known
    other = counted.copy()
    other[: len(known)] &= ~known
    rest = float(np.sum(np.abs(found.gain[other])))
    noise, sd = noise_of(seen, e), np.sqrt(np.diag(found.covariance))
    out = []
    for k in np.flatnonzero(known):
        share = float(found.gain[k]) / total
        if share < 0 and zeta[k] > OVERDAMPED:
            continue
        slope = np.zeros(len(found.covariance))
        slope[m : m + len(counted)][counted] = -found.gain[k] / total**2
        slope[m + k] += 1 / total
        bent = BENT * _model_error(seen, noise, density, float(f_n[k]), float(zeta[k]))
        shape = np.array([REST_SHAPE * rest / total, (2 * np.pi * f_n[k] * h) ** 2 / 24, 2 * zeta[k] * bent]) * share
        least = [found.rest_se / total, LEAST_SHARE, 2 * zeta[k] * bent]
        share_se = float(np.sqrt(slope @ found.covariance @ slope + np.sum(np.square([*shape, *least]))))
        if share_se > KNOWN_TOLD * abs(share):
            continue
        f_se = float(f_n[k]) * float(np.sqrt(sd[2 * k] ** 2 + LEAST_F**2 + (bent * zeta[k]) ** 2))
        zeta_se = float(zeta[k]) * float(np.sqrt(sd[2 * k + 1] ** 2 + LEAST_ZETA_SE**2 + bent**2))
        if zeta_se > KNOWN_ZETA * zeta[k]:
            continue
        out.append(Mode(float(f_n[k]), float(zeta[k]), share, f_se, zeta_se, share_se))
    delay = max(float(found.p[m - 1]) * h, 0.0)
    late = [sd[m - 1], LEAST_DELAY]
    if known.any():  # an error of the response around the first mode is one of the phase
        first = int(np.argmin(np.where(known, f_n, np.inf)))
        error = _model_error(seen, noise, density, float(f_n[first]), float(zeta[first]))
        late.append(BENT * error / (2 * np.pi * float(f_n[first]) * h))
    delay_se = float(np.sqrt(np.sum(np.square(late)))) * h
    return tuple(sorted(out, key=lambda mode: mode.f_n)), delay, delay_se


def _model_error(seen: Seen, noise: Array, density: float, f_n: float, zeta: float) -> float:
    """Return the relative error of the response around a mode, without the part that the sensor noise explains."""
    near = np.abs(np.log(seen.cells.f / f_n)) < max(2 * zeta, 0.05)
    if not near.any():
        return 1.0
    excess = float(np.mean(noise[near])) - density**2 / (2 * seen.h)
    power = float(np.mean(seen.cells.total[near])) / CELL
    return float(np.sqrt(max(excess, 0.0) / power)) if power > 0 else 1.0
