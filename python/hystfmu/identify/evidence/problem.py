"""Least-squares problem of a modal fit: the columns whose weighted sum approximates the output, and the bin weights.

The columns are the response of each mode to the input, free decays of the modes, slow parts, and the rest column. Slow
parts are lags of the input, which represent creep, and a parabola over each record. The rest column is the delayed
input, which represents modes above the band. A cell is a group of `CELL` neighbouring frequency bins of one record (see
`hystfmu.identify.evidence.spectra`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np

from hystfmu.base import Array
from hystfmu.graph.recursion import lag
from hystfmu.identify.evidence.lag import behind_delay, behind_mode, free_decay, prepared
from hystfmu.identify.evidence.spectra import CELL, Cells, Response, Window, smooth

INEXACT = 0.01  # assumed error of the hysteresis model and of the interpolated input, relative to the output in a cell
BEYOND = 1.15  # highest frequency of a fit, relative to the highest coherent frequency
MOST_PARABOLAS, MOST_DECAYS = 8, 3  # with more records, the parabolas or the free decays are omitted
STORED = 6  # number of stored responses of modes


@dataclass(frozen=True)
class Seen:
    """Input v and output y, each relative to its span, and the spectra of the records."""

    h: float
    v: Array
    y: Array
    records: tuple[slice, ...]
    windows: tuple[Window, ...]
    cells: Cells
    response: Response

    def powers(self, e: Array) -> Array:
        """Return the mean power of the bins in each cell, a group of `CELL` neighbouring bins, for a signal e (n,)."""
        return np.concatenate([(np.abs(w.transform(e)) ** 2).reshape(-1, CELL).mean(axis=1) for w in self.windows])

    def noise(self, e: Array) -> Array:
        """Return the noise power of each cell: the smaller of the residual powers of two models.

        The first model is the fit of modes, whose residual is e (n,). The second model is the frequency response that
        was fitted in the cell alone. The second model is less accurate near a lightly damped resonance, because the
        response is curved within a cell.
        """
        left, at, power = [], 0, self.powers(e)
        for w in self.windows:
            left.append(smooth(power[at : at + w.cells]))
            at += w.cells
        return np.minimum(self.cells.noise, np.concatenate(left))


@dataclass(frozen=True)
class Structure:
    """Structure of a fit: the number of modes, and whether the model contains the rest column (delayed input)."""

    modes: int
    rest: bool


@dataclass(frozen=True, eq=False)
class Problem:
    """Least-squares problem: the records, the selected frequency bins, and the weights of the bins.

    ``hold`` is the interpolation of the input between rows (see `hystfmu.identify.evidence.lag`). ``bins`` contains the
    selected bins of each window. ``weight`` contains for each bin 1 divided by the RMS of noise and model error.
    ``slow`` contains the time constants (s) of lags that represent creep.
    """

    seen: Seen
    hold: str
    bins: Sequence[slice] = ()
    weight: Array = field(default_factory=lambda: np.zeros(0))
    slow: tuple[float, ...] = ()

    @classmethod
    def of(
        cls, seen: Seen, hold: str, noise: Array, lowest: float, highest: float, slow: tuple[float, ...] = ()
    ) -> "Problem":
        """Return the problem for the records `seen`, with the bins from `lowest` to `BEYOND` times `highest` (Hz).

        `noise` contains the noise power of each cell. `hold` and `slow` are described in the docstring of the class.
        """
        bins = []
        for w in seen.windows:
            f = w.frequencies(seen.h)
            bins.append(slice(int(np.searchsorted(f, lowest)), int(np.searchsorted(f, highest * BEYOND, "right"))))
        return cls(seen, hold, bins, slow=slow).weighted(noise)

    def weighted(self, noise: Array) -> "Problem":
        """Return the problem with new weights, from the noise power of each cell and the assumed model error."""
        both = np.repeat(noise + INEXACT**2 * self.seen.cells.total / CELL, CELL)
        out, at = [], 0
        for w, b in zip(self.seen.windows, self.bins, strict=True):
            size = w.cells * CELL
            out.append(both[at : at + size][b])
            at += size
        return replace(self, weight=np.asarray(1 / np.sqrt(np.concatenate(out))))

    @cached_property
    def v(self) -> Array:
        """Input (n,) of all records, corrected for the interpolation between rows (`prepared`)."""
        return np.concatenate([prepared(self.seen.v[r], self.hold) for r in self.seen.records])

    def rows(self, columns: Array) -> Array:
        """Return the weighted spectra of signals (n, m) in the selected bins; real parts precede imaginary parts."""
        parts = [w.transform(columns)[b] for w, b in zip(self.seen.windows, self.bins, strict=True)]
        found = np.concatenate(parts) * self.weight[:, None]
        return np.asarray(np.sqrt(2) * np.concatenate([found.real, found.imag]))

    def along(self, run: Callable[[Array], Array]) -> Array:
        """Apply a function to the input of each record, and concatenate the results."""
        return np.concatenate([run(self.v[r]) for r in self.seen.records])

    def columns(self, structure: Structure, p: Array) -> Array:
        """Return the responses of all modes, the rest column, and free decays, (n, modes + rest + decays), for p."""
        modes = [self.mode(float(p[2 * k]), float(p[2 * k + 1]), float(p[-1])) for k in range(structure.modes)]
        delay, h = float(p[-1]) * self.seen.h, self.seen.h
        rest = [self.along(lambda v: behind_delay(v, delay, h, self.hold))] * structure.rest
        return np.vstack([*(mode[:1] for mode in modes), *rest, *(mode[1:] for mode in modes)]).T

    @cached_property
    def mode(self) -> Callable[[float, float, float], Array]:
        """Function `_mode`, which stores its last results: a search changes the parameters of one mode at a time."""
        return lru_cache(maxsize=STORED)(self._mode)

    def _mode(self, ln_f: float, ln_zeta: float, steps: float) -> Array:
        """Return the response of a mode with a delay to the input, and its free decays in all records.

        The shape is (1 + 2 * records, n). Free decays represent a motion of the device at the beginning of a record.
        """
        f_n, zeta, h = float(np.exp(ln_f)), float(np.exp(ln_zeta)), self.seen.h
        some = self.seen.records if len(self.seen.records) <= MOST_DECAYS else ()
        out = np.zeros((1 + 2 * len(some), len(self.v)))
        out[0] = self.along(lambda v: behind_mode(v, f_n, zeta, steps * h, h, self.hold))
        for i, r in enumerate(some):
            made = free_decay(r.stop - r.start, f_n, zeta, h)
            out[2 * i + 1, r], out[2 * i + 2, r.start + 1 : r.stop] = made, made[:-1]
        return out

    def slow_rows(self) -> Array:
        """Return the weighted spectra of the slow parts: lags of the input, and a parabola over each record."""

        filters = [lag(self.seen.h, T) for T in self.slow]
        made = [self.along(lambda v, f=f: f.run((v - v[0])[:, None])[:, 0]) for f in filters]  # type: ignore[misc]
        for r in self.seen.records if len(self.seen.records) <= MOST_PARABOLAS else ():
            t = np.zeros(len(self.v))
            t[r] = np.linspace(-1.0, 1.0, r.stop - r.start) ** 2
            made.append(t)
        return self.rows(np.column_stack(made)) if made else np.zeros((2 * len(self.weight), 0))
