"""Search for the number of modes and for the interpolation of the input between rows, from several start values.

The start values of a new mode and of the delay come from a grid search over frequency, damping ratio and delay. To save
time, the grid search uses cross-spectra that are averaged over neighbouring bins.
"""

from dataclasses import dataclass, replace

import numpy as np

from hystfmu.base import Array, Complex
from hystfmu.identify.evidence.lag import HOLDS
from hystfmu.identify.evidence.modal_fit import MOST_ZETA, Fitted, fit
from hystfmu.identify.evidence.problem import Problem, Seen, Structure
from hystfmu.identify.evidence.spectra import Response

SMOOTH = "smooth"  # assumed interpolation of the input between rows, until fits determine it
GRID = 1200  # number of bins after averaging
DAMPINGS = (0.01, 0.03, 0.1, 0.3, 0.8)
MOST_MODES = 3
# a new mode must reduce the weighted sum of squares by PAYS times the misfit, and by the share PAYS_SHARE; the second
# condition is needed because errors of the hysteresis model are not white noise
PAYS = 60.0
PAYS_SHARE = 0.15
DOUBTFUL, WRONG = 2.0, 6.0  # misfit above which further start values are tried, and above which a fit is rejected
FITS_BETTER = 0.7  # ratio of misfits below which a fit replaces another fit with as many known modes
WIDE, SHORT, LONG = np.arange(-0.5, 6.01, 0.25), np.arange(-0.5, 1.51, 0.25), np.arange(1.5, 3.51, 0.25)
STARTS = ((WIDE, True), (WIDE, False), (SHORT, False), (LONG, False))
"""Delays of the grid search (steps), and whether the first mode is searched without a rest column."""
REST_PAYS, HOLD_PAYS = 25.0, 50.0  # required reduction, as for PAYS: by a rest column, by the chosen interpolation
BELOW, SLOW = 100.0, 20.0  # ratio of the lowest mode to the lowest frequency of the fit, and to the frequency of creep


@dataclass(frozen=True)
class Pooled:
    """Input power spectrum |V|^2 and cross-spectrum V* Y at the frequencies f (n,), times the squared weights."""

    f: Array
    power: Array
    cross: Complex

    @classmethod
    def of(cls, f: Array, v: Complex, y: Complex, weight: Array) -> "Pooled":
        """Sum the spectra over groups of neighbouring bins, in the order of increasing frequency."""
        order = np.argsort(f, kind="stable")
        f, power = f[order], (np.abs(v) ** 2 * weight**2)[order]
        cross = (v.conj() * y * weight**2)[order]
        size = -(-len(f) // GRID)
        starts = np.arange(0, len(f), size)
        count = np.diff(np.append(starts, len(f)))
        return cls(np.add.reduceat(f, starts) / count, np.add.reduceat(power, starts), np.add.reduceat(cross, starts))


def mode_response(f: Array, f_n: float | Array, zeta: float | Array) -> Complex:
    """Return the frequency response 1/(1 + 2 zeta s/omega_n + s^2/omega_n^2) of a mode at the frequencies f (Hz)."""
    x = f / f_n
    return np.asarray(1 / (1 - x * x + 2j * zeta * x))


def scan(
    pooled: Pooled, known: list[Complex], lowest: float, highest: float, h: float, delays: Array
) -> tuple[float, float, float]:
    """Return f_n (Hz), zeta and delay (steps) of the additional mode that reduces the residual most.

    `pooled` contains the spectra. `known` contains the frequency responses, without the delay, of the modes found so
    far and of the rest column (delayed input). f_n is searched between `lowest` and `highest` (Hz). `delays` contains
    the tried delays (steps). h is the step (s).
    """
    root = np.sqrt(pooled.power)
    some = root > 0
    f, root = pooled.f[some], root[some]
    target = (pooled.cross[some] / root)[:, None] * np.exp(2j * np.pi * f[:, None] * h * delays)
    target = _real(target)
    if known:
        q, r = np.linalg.qr(_real(np.column_stack(known)[some] * root[:, None]))
        q = q[:, np.abs(np.diag(r)) > 1e-9 * np.abs(np.diag(r)).max()]
        target -= q @ (q.T @ target)
    before = np.sum(target**2, axis=0)
    best = (np.inf, lowest, 0.7, 0.0)
    for zeta in DAMPINGS:
        count = max(int(np.log(highest / lowest) / np.log1p(min(zeta, 0.15))), 2)
        f_n = np.geomspace(lowest, highest, count)
        g = _real(mode_response(f[:, None], f_n, zeta) * root[:, None])
        if known:
            g -= q @ (q.T @ g)
        left = before - (g.T @ target) ** 2 / np.maximum(np.sum(g * g, axis=0), 1e-300)[:, None]
        i, j = np.unravel_index(np.argmin(left), left.shape)
        if left[i, j] < best[0]:
            best = (float(left[i, j]), float(f_n[i]), zeta, float(delays[j]))
    return best[1:]


def _real(x: Complex) -> Array:
    return np.vstack([x.real, x.imag])


def modes(seen: Seen) -> tuple[str, Fitted] | None:
    """Return the interpolation of the input between rows, and the fit with as many modes as the record determines.

    If input and output are coherent at fewer than three frequencies, the result is None.
    """
    at = np.flatnonzero(seen.response.seen)
    if len(at) < 3:
        return None
    highest = _highest(seen.response)
    problem = Problem.of(seen, SMOOTH, seen.cells.noise, seen.response.f[0], highest)
    none = fit(problem, Structure(0, True), np.array([0.0]))
    best, fitted, known, least = problem, none, 0, none.misfit
    for start in STARTS:
        branch = _branch(seen, highest, none, start)
        for trial, found in branch:
            count = int(np.sum(found.known(seen)))
            if count > known or (count == known > 0 and found.misfit < FITS_BETTER * fitted.misfit):
                best, fitted, known = trial, found, count
            least = min(least, found.misfit)
        if least < DOUBTFUL or not (branch or start[1]):
            break  # other start values lead to other local minima, which is useful only after a poor fit
    if not known or fitted.misfit > WRONG:
        return SMOOTH, none
    return _held(seen, best, fitted)


def _branch(seen: Seen, highest: float, none: Fitted, start: tuple[Array, bool]) -> list[tuple[Problem, Fitted]]:
    """Return the fits with 1, 2, ... modes from the start values `start`, until a new mode does not improve the fit."""
    last, noise, found = none, seen.cells.noise, []
    for _ in range(MOST_MODES):
        grown = _grown(seen, noise, highest, last, start)
        if grown is None:
            break
        trial, fitted = grown
        before = fit(trial, last.structure, last.p)
        gone = before.error - fitted.error
        if gone < PAYS * max(fitted.misfit, 1.0) or gone < PAYS_SHARE * before.error:
            break
        if np.exp(fitted.p[1:-1:2].max()) > 0.95 * MOST_ZETA:
            break  # the new mode is creep, or no mode
        noise = seen.noise(fitted.left(trial))
        trial = trial.weighted(noise)
        last = fit(trial, fitted.structure, fitted.p)
        found.append((trial, last))
    return found


def _highest(r: Response) -> float:
    """Return the highest frequency (Hz) of the coherent band.

    Up to this frequency, at least half of the points of each third of an octave are coherent.
    """
    seen = r.seen
    for k in range(len(seen) - 1, -1, -1):
        near = (r.f <= r.f[k]) & (r.f >= r.f[k] / 2 ** (1 / 3))
        if seen[k] and np.mean(seen[near]) >= 0.5:
            return float(r.f[k])
    return float(r.f[0])


def _held(seen: Seen, problem: Problem, best: Fitted) -> tuple[str, Fitted]:
    """Determine the interpolation of the input between rows; return its name and the fit with this interpolation.

    Ramps and constant values change the response by a factor 1 - (omega h)^2/12 or 1 - (omega h)^2/24, which is similar
    to the effect of a rest column (delayed input). Constant values also add a delay of half a step. Therefore an
    interpolation is identified only if the fit with this interpolation needs no rest column. It is unlikely that a true
    rest column equals this effect within five standard errors.
    """
    modes = best.structure.modes
    tried = {}
    for hold in HOLDS:
        p = best.p + np.append(np.zeros(2 * modes), -0.5 if hold == "zoh" else 0.0)
        tried[hold] = fit(replace(problem, hold=hold), Structure(modes, False), p)
    hold = min(tried, key=lambda k: tried[k].error)
    scale = max(tried[hold].misfit, 1.0)
    other = min(f.error for k, f in tried.items() if (k == "zoh") != (hold == "zoh"))
    if tried[hold].error - best.error > REST_PAYS * scale or other - tried[hold].error < HOLD_PAYS * scale:
        return SMOOTH, _half(best)
    # a small rest column may exist although it is not significant, so its standard error is kept
    rest_se = float(np.sqrt(best.covariance[-1, -1]))
    return hold, replace(tried[hold], covariance=best.covariance[:-1, :-1], rest_se=rest_se)


def _half(found: Fitted) -> Fitted:
    """Reduce the delay of a fit by a quarter of a step, and add a quarter of a step to its standard error.

    The interval of the delay then contains the values for a smooth input and for a constant input between rows. The
    standard error of the result is the root of the sum of the squares of the two errors.
    """
    p, covariance = found.p.copy(), found.covariance.copy()
    at = len(p) - 1
    p[at] -= 0.25
    covariance[at, at] += 0.25**2
    return replace(found, p=p, covariance=covariance)


def _grown(
    seen: Seen, noise: Array, highest: float, best: Fitted, start: tuple[Array, bool]
) -> tuple[Problem, Fitted] | None:
    """Fit the structure of `best` with one more mode; return None if the band is too narrow for a new mode."""
    r, h = seen.response, seen.h
    f_0 = [float(np.exp(best.p[2 * k])) for k in range(best.structure.modes)]
    longest = max(w.n for w in seen.windows) * h
    lowest = max(10 / longest, 2 * float(r.f[0]))
    top = min(highest, 0.45 / h)  # a mode above `HIGHEST` is fitted but not reported
    if top <= 1.5 * lowest:
        return None
    (delays, alone), count = start, len(f_0) + 1
    problem = Problem.of(seen, SMOOTH, noise, max(min(f_0, default=lowest) / BELOW, float(r.f[0])), highest)
    f, v, y = [], [], []
    for w, b in zip(seen.windows, problem.bins, strict=True):
        f.append(w.frequencies(h)[b])
        v.append(w.transform(problem.v)[b])
        y.append(w.transform(seen.y)[b])
    f_all = np.concatenate(f)
    # the correction of a smooth input and the loss by linear interpolation, sinc^2, cancel each other
    v_all = np.concatenate(v) * np.sinc(f_all * h) ** 2
    pooled = Pooled.of(f_all, v_all, np.concatenate(y), problem.weight)
    known: list[Complex] = [] if alone and count == 1 else [np.ones(len(pooled.f), dtype=np.complex128)]
    for k in range(best.structure.modes):
        known.append(mode_response(pooled.f, f_0[k], float(np.exp(best.p[2 * k + 1]))))
    f_n, zeta, delay = scan(pooled, known, lowest, top, h, delays)
    first = min([*f_0, f_n])
    slow = (SLOW / (2 * np.pi * first),)
    problem = Problem.of(seen, SMOOTH, noise, max(first / BELOW, float(r.f[0])), highest, slow)
    p = np.concatenate([best.p[:-1], [np.log(f_n), np.log(zeta), delay]])
    return problem, fit(problem, Structure(count, True), p)
