"""Records prepared for fits: signals over their spans, spectra, and the weights of bins."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.identify.evidence.lag import prepared
from hystfmu.identify.evidence.modal_fit import Fitted, Problem
from hystfmu.identify.evidence.spectra import CELL, Cells, Response, Window, smooth

INEXACT = 0.01  # of the output in a cell: error of the model of the hysteresis and of the input between rows
BEYOND = 1.15  # last bin of a fit, over the highest frequency that is seen


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


def problem_of(seen: Seen, hold: str, noise: Array, lowest: float, highest: float, slow: tuple[float, ...]) -> Problem:
    """Return the problem of a fit to the bins from `lowest` to beyond `highest` (Hz), with the noise of each cell."""
    bins = []
    for w in seen.windows:
        f = w.frequencies(seen.h)
        bins.append(slice(int(np.searchsorted(f, lowest)), int(np.searchsorted(f, highest * BEYOND, "right"))))
    v = held_input(seen, hold)
    p = Problem(seen.h, hold, v, seen.y, seen.records, seen.windows, bins, np.zeros(0), slow)
    return replace(p, weight=weight_of(seen, p, noise))


def held_input(seen: Seen, hold: str) -> Array:
    """Return the input (n,) whose ramps or steps stand for the input between rows."""
    return np.concatenate([prepared(seen.v[r], hold) for r in seen.records])


def weight_of(seen: Seen, problem: Problem, noise: Array) -> Array:
    """Return the inverse of the RMS of noise and model error in each bin that counts."""
    both = np.repeat(noise + INEXACT**2 * seen.cells.total / CELL, CELL)
    out, at = [], 0
    for w, b in zip(seen.windows, problem.bins, strict=True):
        size = w.cells * CELL
        out.append(both[at : at + size][b])
        at += size
    return np.asarray(1 / np.sqrt(np.concatenate(out)))


def left_over(seen: Seen, hold: str, found: Fitted) -> Array:
    """Return the output (n,) minus that of a fit."""
    problem = Problem(seen.h, hold, held_input(seen, hold), seen.y, seen.records, (), (), np.zeros(0), ())
    return np.asarray(seen.y - found.output(problem))


def powers(seen: Seen, e: Array) -> Array:
    """Return the mean power of a signal (n,) in each cell."""
    return np.concatenate([(np.abs(w.transform(e)) ** 2).reshape(-1, CELL).mean(axis=1) for w in seen.windows])


def noise_of(seen: Seen, e: Array) -> Array:
    """Return the noise of each cell: the residual of a fit or of the local response, whichever is smaller.

    With a lightly damped resonance the response is curved within a cell.
    """
    left, at, power = [], 0, powers(seen, e)
    for w in seen.windows:
        left.append(smooth(power[at : at + w.cells]))
        at += w.cells
    return np.minimum(seen.cells.noise, np.concatenate(left))
