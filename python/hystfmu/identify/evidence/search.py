"""From a record to `Evidence`: local responses, noise, then as many modes as pay."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.identify.evidence.found import Evidence, Mode
from hystfmu.identify.evidence.lag import HOLDS, prepared
from hystfmu.identify.evidence.modal_fit import LEAST_ZETA, MOST_ZETA, Fitted, Problem, Structure, columns, fit, slow_rows
from hystfmu.identify.evidence.scan import Pooled, mode_response, scan
from hystfmu.identify.evidence.spectra import (
    CELL,
    Cells,
    Complex,
    Response,
    Window,
    cells_of,
    LOCAL,
    noise_density,
    quiet_density,
    response,
    smooth,
)

MOST_MODES = 3
PAYS = 60.0  # drop of the weighted sum of squares, over the misfit, that a mode must give
INEXACT = 0.01  # of the output in a cell: error of the model of the hysteresis and of the input between rows
BELOW, SLOW = 100.0, 20.0  # lowest frequency of the fit and of the slow parts, as fractions of the lowest mode
BEYOND = 1.15  # last bin of the fit, over the highest frequency that is seen
KNOWN_F, KNOWN_ZETA, KNOWN_SHARE = 0.1, 0.5, 1 / 5  # largest relative standard errors of a mode
KNOWN_TOLD = 0.5  # the same of its share, with the errors of its shape
HIGHEST = 0.35  # frequency of a mode over the sample rate
PAYS_SHARE = 0.03  # and of all of it, because errors of the model of the hysteresis are no white noise
DOUBTFUL, WRONG = 2.0, 16.0  # misfit that asks for other starts, and that no fit has
DELAYS = (np.arange(-0.5, 6.01, 0.25), np.arange(-0.5, 1.51, 0.25), np.arange(1.5, 3.51, 0.25))  # steps, of starts
REST_PAYS, HOLD_PAYS = 9.0, 50.0  # the same for a rest, and for held values against a smooth input
REST_SHAPE = 0.5  # share of a rest that may be the rise of its mode towards its resonance
LEAST_F, LEAST_ZETA_SE, LEAST_SHARE, LEAST_DELAY = 1e-4, 3e-3, 2e-3, 0.05
"""Least standard errors: relative of f_n and zeta, of a share, and of the delay in steps.  Drawn devices with modes above
the band and inputs that are no ramps between rows have errors of this size where the noise allows smaller ones."""


@dataclass(frozen=True)
class Seen:
    """Input and output over their spans, with the spectra of the records."""

    h: float
    v: Array
    y: Array
    records: tuple[slice, ...]
    windows: tuple[Window, ...]
    cells: Cells
    response: Response


def evidence(data: Dataset, v: Array | None = None) -> Evidence:
    """Find band, frequency response, modes, delay and noise of records.

    Parameters
    ----------
    data : Dataset
        With a measured output; its training rows count.
    v : array, shape (n,), optional
        Output of the static hysteresis in front of the dynamics; default the input.
    """
    rows = [slice(max(r.start, data.train.start), min(r.stop, data.train.stop)) for r in data.records]
    windows = tuple(w for r in rows if r.stop > r.start and (w := Window.of(r)))
    x = np.asarray(data.u if v is None else v, dtype=np.float64)
    wide, high = float(np.ptp(x)), float(np.ptp(data.y[data.train]))
    if not windows or not wide > 0 or not high > 0:
        none = np.zeros(0)
        return Evidence(data.h, "foh", (0.0, 0.0), none, none, none, none, none, (), 0.0, np.inf, np.nan, np.nan)
    x, y = (x - x[0]) / wide, (data.y - data.y[0]) / high
    cells = cells_of(windows, data.h, x, y)
    seen = Seen(data.h, x, y, data.records, windows, cells, response(cells))
    best = _modes(seen)
    hold, found = ("foh", None) if best is None else best
    density = high * _density(seen, hold, found)
    noise = density * float(np.sqrt(0.5 / data.h))
    static = _static_gain(seen.response, found)
    r = seen.response
    modes, delay, delay_se = _told(found, seen)
    return Evidence(
        data.h,
        hold,
        r.band(),
        r.f,
        np.abs(r.g) / static,
        np.unwrap(np.angle(r.g)) if len(r.g) else np.zeros(0),
        r.coherence,
        r.level,
        modes,
        delay,
        delay_se,
        noise,
        density,
    )


def _static_gain(r: Response, found: Fitted | None) -> float:
    if found is not None and found.structure.modes:
        return abs(float(found.gain.sum())) or 1.0
    seen = np.flatnonzero(r.seen)
    return float(np.median(np.abs(r.g[seen[: max(len(seen) // 3, 1)]]))) or 1.0 if len(seen) else 1.0


def _modes(seen: Seen) -> tuple[str, Fitted] | None:
    """Return the hold and the fit with as many modes as pay; None if the record shows no response."""
    at = np.flatnonzero(seen.response.seen)
    if len(at) < 3:
        return None
    highest = _highest(seen.response)
    noise = seen.cells.noise
    hold = "smooth"
    problem = _problem(seen, hold, noise, seen.response.f[0], highest, ())
    none = fit(problem, Structure(0, True), np.array([0.0]))
    best, fitted, known = problem, none, 0
    for delays in DELAYS:
        branch = _branch(seen, hold, highest, problem, none, delays)
        for trial, found in branch:
            count = int(np.sum(_known(found, seen)))
            if (count, -found.misfit) > (known, -fitted.misfit) and count:
                best, fitted, known = trial, found, count
        if not branch or fitted.misfit < DOUBTFUL:
            break  # other delays are other local minima, for a fit that is none
    if not known or fitted.misfit > WRONG:
        return hold, none
    return _held(seen, best, fitted)


def _branch(
    seen: Seen, hold: str, highest: float, problem: Problem, none: Fitted, delays: Array
) -> list[tuple[Problem, Fitted]]:
    """Add modes while they pay, from a start with one of the delays."""
    last, noise, found = none, seen.cells.noise, []
    for count in range(1, MOST_MODES + 1):
        grown = _grown(seen, hold, noise, highest, last, count, delays)
        if grown is None:
            break
        trial, fitted = grown
        before = fit(trial, last.structure, last.p)
        gone = before.error - fitted.error
        if gone < PAYS * max(fitted.misfit, 1.0) or gone < PAYS_SHARE * before.error:
            break
        noise = _noise(seen, trial, fitted)
        trial = replace(trial, weight=_weight(seen, trial, noise))
        last = fit(trial, fitted.structure, fitted.p)
        found.append((trial, last))
    return found


def _held(seen: Seen, problem: Problem, best: Fitted) -> tuple[str, Fitted]:
    """Decide how the input behaves between rows, and whether the rest is needed.

    A hold changes the response by a factor 1 - (omega h)^2/12 or /24, which looks like a rest; held values differ from a
    smooth input by half a step of delay too.  So a hold is known only where it alone needs no rest.
    """
    modes = best.structure.modes
    tried = {}
    for hold in HOLDS:
        p = best.p + np.append(np.zeros(2 * modes), -0.5 if hold == "zoh" else 0.0)
        tried[hold] = fit(replace(problem, hold=hold, v=prepared_all(seen, hold)), Structure(modes, False), p)
    hold = min(tried, key=lambda k: tried[k].error)
    scale = max(tried[hold].misfit, 1.0)
    other = min(f.error for k, f in tried.items() if (k == "zoh") != (hold == "zoh"))
    if tried[hold].error - best.error > REST_PAYS * scale or other - tried[hold].error < HOLD_PAYS * scale:
        return "smooth", _half(best)
    # a rest that does not pay may be there: it counts in the errors
    rest_se = float(np.sqrt(best.covariance[-1, -1]))
    return hold, replace(tried[hold], covariance=best.covariance[:-1, :-1], rest_se=rest_se)


def _half(found: Fitted) -> Fitted:
    """Let the delay of a smooth input stand for that of held values as well: a quarter of a step less, and more or less."""
    p, covariance = found.p.copy(), found.covariance.copy()
    at = len(p) - 1
    p[at] -= 0.25
    covariance[at, at] += 0.25**2
    return replace(found, p=p, covariance=covariance)


def _highest(r: Response) -> float:
    """Return the highest frequency (Hz) up to which at least half of the points of a third of an octave are seen."""
    seen = r.seen
    for k in range(len(seen) - 1, -1, -1):
        near = (r.f <= r.f[k]) & (r.f >= r.f[k] / 2 ** (1 / 3))
        if seen[k] and np.mean(seen[near]) >= 0.5:
            return float(r.f[k])
    return float(r.f[0])


def prepared_all(seen: Seen, hold: str) -> Array:
    return np.concatenate([prepared(seen.v[r], hold) for r in seen.records])


def _problem(seen: Seen, hold: str, noise: Array, lowest: float, highest: float, slow: tuple[float, ...]) -> Problem:
    bins = []
    for w in seen.windows:
        f = w.frequencies(seen.h)
        bins.append(slice(int(np.searchsorted(f, lowest)), int(np.searchsorted(f, highest * BEYOND, "right"))))
    v = prepared_all(seen, hold)
    p = Problem(seen.h, hold, v, seen.y, seen.records, seen.windows, bins, np.zeros(0), slow)
    return replace(p, weight=_weight(seen, p, noise))


def _weight(seen: Seen, problem: Problem, noise: Array) -> Array:
    """Return one over the RMS of noise and model error in each bin that counts."""
    both = np.repeat(noise + INEXACT**2 * seen.cells.total / CELL, CELL)
    out, at = [], 0
    for w, b in zip(seen.windows, problem.bins, strict=True):
        size = w.cells * CELL
        out.append(both[at : at + size][b])
        at += size
    return np.asarray(1 / np.sqrt(np.concatenate(out)))


def _noise(seen: Seen, problem: Problem, found: Fitted) -> Array:
    """Return the noise of each cell: what the modes leave, where that is less than what the local response leaves.

    A light resonance bends the response inside a cell.
    """
    v = columns(problem, found.structure, found.p) @ found.gain
    e = seen.y - v
    left, at = [], 0
    for w in seen.windows:
        power = np.abs(w.transform(e)) ** 2
        left.append(smooth(power.reshape(-1, CELL).mean(axis=1)))
    return np.minimum(seen.cells.noise, np.concatenate(left))


def _grown(
    seen: Seen, hold: str, noise: Array, highest: float, best: Fitted, count: int, delays: Array
) -> tuple[Problem, Fitted] | None:
    """Add a mode to a fit."""
    r, h = seen.response, seen.h
    f_0 = [float(np.exp(best.p[2 * k])) for k in range(best.structure.modes)]
    longest = max(w.n for w in seen.windows) * h
    lowest = max(10 / longest, 2 * float(r.f[0]))
    top = min(highest, 0.45 / h)  # a mode above `HIGHEST` is fitted, not told
    if top <= 1.5 * lowest:
        return None
    start = min(f_0, default=lowest)
    problem = _problem(seen, hold, noise, max(start / BELOW, float(r.f[0])), highest, ())
    f, v, y = [], [], []
    for w, b in zip(seen.windows, problem.bins, strict=True):
        f.append(w.frequencies(h)[b])
        v.append(w.transform(problem.v)[b])
        y.append(w.transform(seen.y)[b])
    f_all = np.concatenate(f)
    # ramps through the corrected rows are the smooth input: their loss and the correction cancel
    v_all = np.concatenate(v) * np.sinc(f_all * h) ** 2
    pooled = Pooled.of(f_all, v_all, np.concatenate(y), problem.weight)
    known: list[Complex] = [np.ones(len(pooled.f), dtype=np.complex128)]
    for k in range(best.structure.modes):
        known.append(mode_response(pooled.f, f_0[k], float(np.exp(best.p[2 * k + 1]))))
    f_n, zeta, delay = scan(pooled, known, lowest, top, h, delays)
    first = min([*f_0, f_n])
    slow = (SLOW / (2 * np.pi * first),)
    problem = _problem(seen, hold, noise, max(first / BELOW, float(r.f[0])), highest, slow)
    p = np.concatenate([best.p[:-1], [np.log(f_n), np.log(zeta), delay]])
    return problem, fit(problem, Structure(count, True), p)


def _known(found: Fitted, seen: Seen) -> NDArray[np.bool_]:
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


def _density(seen: Seen, hold: str, found: Fitted | None) -> float:
    """Return the density of the noise in spans of y: the least of what local responses, the fit, or quiet rows leave."""
    left = [noise_density(seen.cells.left / (CELL - LOCAL), 2 * (CELL - LOCAL), seen.cells.f, seen.h)]
    e = seen.y
    if found is not None:
        problem = _problem(seen, hold, seen.cells.noise, seen.response.f[0], 0.5 / seen.h, ())
        e = seen.y - columns(problem, found.structure, found.p) @ found.gain
        power = np.concatenate(
            [(np.abs(w.transform(e)) ** 2).reshape(-1, CELL).mean(axis=1) for w in seen.windows]
        )
        left.append(noise_density(power, 2 * CELL, seen.cells.f, seen.h))
    left.append(quiet_density([e[w.rows] for w in seen.windows], seen.h))
    return min(left)


def _told(found: Fitted | None, seen: Seen) -> tuple[tuple[Mode, ...], float, float]:
    """Return the modes that are known by frequency, the delay and its standard error (s)."""
    h = seen.h
    if found is None:
        return (), 0.0, float("inf")
    m, known = len(found.p), _known(found, seen)
    total = float(found.gain.sum())
    # a rest is a mode above the band, which is larger there than at rest, and so is a mode that is not known
    other = np.append(~known, found.structure.rest)[: len(found.gain)]
    rest = float(np.sum(np.abs(found.gain[other])))
    out = []
    for k in np.flatnonzero(known):
        f_n, zeta = (float(x) for x in np.exp(found.p[2 * k : 2 * k + 2]))
        slope = np.zeros(len(found.covariance))
        slope[m:] = -found.gain[k] / total**2
        slope[m + k] += 1 / total
        shape = np.array([REST_SHAPE * rest / total, (2 * np.pi * f_n * h) ** 2 / 24]) * found.gain[k] / total
        shape = np.append(shape, [found.rest_se / total, LEAST_SHARE])
        share_se = float(np.sqrt(slope @ found.covariance @ slope + np.sum(np.square(shape))))
        if share_se > KNOWN_TOLD * abs(found.gain[k] / total):
            continue
        f_se, zeta_se = np.hypot(np.sqrt(np.diag(found.covariance)[2 * k : 2 * k + 2]), (LEAST_F, LEAST_ZETA_SE))
        out.append(Mode(f_n, zeta, float(found.gain[k]) / total, f_n * float(f_se), zeta * float(zeta_se), share_se))
    delay = max(float(found.p[m - 1]) * h, 0.0)
    delay_se = float(np.hypot(np.sqrt(found.covariance[m - 1, m - 1]), LEAST_DELAY)) * h
    return tuple(sorted(out, key=lambda mode: mode.f_n)), delay, delay_se
