"""Text of the evidence of a fit: known modes, their standard errors, the delay, and the noise of the sensor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.identify.evidence.found import Mode
from hystfmu.identify.evidence.modal_fit import LEAST_ZETA, MOST_ZETA, Fitted
from hystfmu.identify.evidence.records import Seen, noise_of, powers
from hystfmu.identify.evidence.spectra import CELL, LOCAL, Response, noise_density, quiet_density

KNOWN_F, KNOWN_ZETA, KNOWN_SHARE = 0.1, 0.5, 1 / 5  # largest relative standard errors of a mode
KNOWN_TOLD = 0.5  # the same of its share, with the errors of its shape
HIGHEST = 0.35  # frequency of a mode over the sample rate
OVERDAMPED = 0.5  # damping ratio from which a part below the modes is creep, and one of negative share none
REST_SHAPE = 0.5  # share of a rest that may be the rise of its mode towards its resonance
BENT = 0.5  # error of f_n over the half width of the resonance, for an error of the response there
LEAST_F, LEAST_ZETA_SE, LEAST_SHARE, LEAST_DELAY = 1e-4, 3e-3, 2e-3, 0.05
"""Least standard errors: relative of f_n and zeta, of a share, and of the delay in steps.  Drawn devices with modes
above the band and inputs that are no ramps between rows have such errors where the noise allows smaller ones."""


def known_modes(found: Fitted, seen: Seen) -> NDArray[np.bool_]:
    """Tell which modes the record determines: standard errors, bounds, and excitation around them."""
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
    """Return the density of the noise in spans of y: the least of the residuals of local responses, of a fit, and of
    rows at rest."""
    left = seen.cells.left / (CELL - LOCAL)
    return min(
        noise_density(left, 2 * (CELL - LOCAL), seen.cells.f, seen.h),
        noise_density(powers(seen, e), 2 * CELL, seen.cells.f, seen.h),
        quiet_density([e[w.rows] for w in seen.windows], seen.h),
    )


def static_gain(r: Response, found: Fitted | None) -> float:
    """Return the static gain: of all parts of a fit, or of the lowest third of the coherent points."""
    if found is not None and found.structure.modes:
        return abs(float(found.gain.sum())) or 1.0
    seen = np.flatnonzero(r.seen)
    return float(np.median(np.abs(r.g[seen[: max(len(seen) // 3, 1)]]))) or 1.0 if len(seen) else 1.0


def told(found: Fitted | None, seen: Seen, e: Array, density: float) -> tuple[tuple[Mode, ...], float, float]:
    """Return the modes that are known by frequency, the delay and its standard error (s).

    Parameters
    ----------
    found : Fitted, optional
    seen : Seen
    e : array, shape (n,)
        Residual of the fit.
    density : float
        Of the noise, in spans of y.
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
    """Return the relative error of the response around a mode that the noise of the sensor does not explain."""
    near = np.abs(np.log(seen.cells.f / f_n)) < max(2 * zeta, 0.05)
    if not near.any():
        return 1.0
    excess = float(np.mean(noise[near])) - density**2 / (2 * seen.h)
    power = float(np.mean(seen.cells.total[near])) / CELL
    return float(np.sqrt(max(excess, 0.0) / power)) if power > 0 else 1.0
