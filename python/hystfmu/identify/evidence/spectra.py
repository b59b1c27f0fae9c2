"""Spectra of records, cell by cell: the part of the output that follows the input, and the remaining noise.

A cell is eight neighbouring bins of the Fourier transform of a whole record. In each cell, Y = (g_0 + g_1 f) V + E is
fitted (a local polynomial: Pintelon & Schoukens, System Identification, 2nd ed. 2012, section 7.2). E is noise and
every other part of the output that no linear response explains. Whole records need no windows, which could hide a short
chirp. They also give the finest resolution for light damping.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len, rfft
from scipy.special import betaincinv

from hystfmu.base.arrays import Array

Complex = NDArray[np.complex128]
CELL, LOCAL = 8, 2  # bins in a cell, complex coefficients of the response in it
ALPHA, SURE = 0.01, 1e-5  # probabilities of chance: of the level, and of a point behind a gap of the band
POINTS = 150  # of the frequency response, at most
LEAST_ROWS = 64
QUIET, QUIET_FREEDOM = 40, 13.9
LEAST_POINTS = 3  # of a band
AGREE = 0.03  # relative change of the response over a gap in which there is no mode


@dataclass(frozen=True)
class Window:
    """Rows of a record; their number is suitable for a fast Fourier transform."""

    rows: slice

    @classmethod
    def of(cls, rows: slice) -> Window | None:
        """Cut at most a few per cent off the beginning; return None if the record is too short."""
        n = rows.stop - rows.start
        while n >= LEAST_ROWS and next_fast_len(n, real=True) != n:
            n -= 1
        return cls(slice(rows.stop - n, rows.stop)) if n >= LEAST_ROWS else None

    @property
    def n(self) -> int:
        """Number of rows."""
        return int(self.rows.stop - self.rows.start)

    @property
    def cells(self) -> int:
        """Number of cells; the cells exclude the bins at DC and at half the sample rate."""
        return (self.n // 2 - 1) // CELL

    def frequencies(self, h: float) -> Array:
        """Return the frequency (Hz) of each bin of the cells."""
        return np.arange(1, self.cells * CELL + 1) / (self.n * h)

    def transform(self, x: Array) -> Complex:
        """Return the bins of a signal (n,), or of columns (n, m), without the line through the ends.

        White noise of variance s^2 has a mean power of s^2 in each bin.
        """
        x = x[self.rows]
        ends = x[-1] - x[0]
        line = np.linspace(0.0, 1.0, self.n)
        level = x - (line[:, None] * ends if x.ndim > 1 else line * ends)
        return np.asarray(rfft(level, axis=0)[1 : self.cells * CELL + 1] / np.sqrt(self.n))


@dataclass(frozen=True)
class Cells:
    """Cells of all records: centre (Hz), response, powers, and noise of one bin; each field has shape (cells,)."""

    f: Array
    g: Complex
    weight: Array
    total: Array
    left: Array
    noise: Array


def cells_of(windows: Sequence[Window], h: float, v: Array, y: Array) -> Cells:
    """Fit the local responses of all records."""
    found = [_cells(w, h, v, y) for w in windows]
    return Cells(
        *(np.concatenate([getattr(c, k) for c in found]) for k in ("f", "g", "weight", "total", "left", "noise"))
    )


def _cells(window: Window, h: float, v: Array, y: Array) -> Cells:
    shape = (window.cells, CELL)
    seen, out = window.transform(v).reshape(shape), window.transform(y).reshape(shape)
    f = window.frequencies(h).reshape(shape).mean(axis=1)
    x = np.linspace(-1.0, 1.0, CELL)
    size = np.sqrt(np.sum(np.abs(seen) ** 2, axis=1, keepdims=True))
    size[size == 0] = 1.0
    columns = np.stack([seen / size, seen / size * x], axis=2)
    q = np.linalg.qr(columns)[0]
    along = np.einsum("kij,ki->kj", q.conj(), out)
    total = np.sum(np.abs(out) ** 2, axis=1)
    left = np.sum(np.abs(out - np.einsum("kij,kj->ki", q, along)) ** 2, axis=1)
    power = size[:, 0] ** 2
    # the mean over the cell, not its centre: far better known where the input is in few bins
    g = np.sum(seen.conj() * out, axis=1) / power
    return Cells(f, g, power, total, left, smooth(left / (CELL - LOCAL)))


def smooth(x: Array) -> Array:
    """Return the mean over neighbours within 2 cells, or within 4 % of the frequency if that is more."""
    k = np.arange(len(x))
    wide = np.maximum(2, (0.04 * k).astype(int))
    total = np.concatenate([[0.0], np.cumsum(x)])
    lo, hi = np.maximum(k - wide, 0), np.minimum(k + wide + 1, len(x))
    return np.asarray(np.maximum((total[hi] - total[lo]) / (hi - lo), 1e-300))


@dataclass(frozen=True)
class Response:
    """Frequency response, coherence, its chance level and significance, at points (n,)."""

    f: Array
    g: Complex
    coherence: Array
    level: Array
    sure: NDArray[np.bool_]

    @property
    def seen(self) -> NDArray[np.bool_]:
        """True at frequencies where chance does not explain the coherence."""
        return self.coherence > self.level

    def band(self) -> tuple[float, float]:
        """Return the band (Hz) from the lowest frequency to the first gap; (0, 0) if there is none.

        A mode between two points an octave apart affects the response at these points. In a wider gap, a mode changes
        the response by twice its share of the static gain from one side of the gap to the other side.
        """
        at = np.flatnonzero(self.seen)
        at = at[np.argmax(self.sure[at]) :] if self.sure.any() else at[:0]
        if not len(at):
            return 0.0, 0.0
        first = last = at[0]
        for k in at[1:]:
            if k > last + 1 and self.f[k] > 2 * self.f[last] and not self._agree(last, k):
                break
            if k <= last + 2 or self.sure[k]:
                last = k
        if np.sum(self.seen[first : last + 1]) < LEAST_POINTS:  # lines through the ends of two signals are alike
            return 0.0, 0.0
        return float(self.f[first]), float(self.f[last])

    def _agree(self, last: int, k: int) -> bool:
        sure = np.flatnonzero(self.sure)
        below, above = (np.abs(self.g[s]) for s in (sure[sure <= last][-3:], sure[sure >= k][:3]))
        return len(above) == 3 and bool(abs(np.mean(above) / np.mean(below) - 1) < AGREE)


def response(cells: Cells) -> Response:
    """Pool the cells to at most `POINTS` points, evenly over the logarithm of the frequency."""
    lowest, highest = cells.f.min(), cells.f.max()
    edge = np.geomspace(lowest, highest * (1 + 1e-9), POINTS + 1)
    place = np.clip(np.searchsorted(edge, cells.f, "right") - 1, 0, POINTS - 1)

    def pooled(x: Array) -> Array:
        return np.asarray(np.bincount(place, x, POINTS), dtype=np.float64)

    count = np.bincount(place, minlength=POINTS)
    some = count > 0
    total, left = pooled(cells.total / cells.noise)[some], pooled(cells.left / cells.noise)[some]
    weight = cells.weight / cells.noise
    share = np.maximum(pooled(weight)[some], 1e-300)
    count = count[some]
    level = betaincinv(LOCAL * count, (CELL - LOCAL) * count, 1 - ALPHA)
    coherence = np.where(total > 0, 1 - left / np.maximum(total, 1e-300), 0.0)
    return Response(
        np.asarray(pooled(cells.f * weight)[some] / share, dtype=np.float64),
        np.asarray(
            (pooled(cells.g.real * weight) + 1j * pooled(cells.g.imag * weight))[some] / share, dtype=np.complex128
        ),
        np.asarray(coherence, dtype=np.float64),
        np.asarray(level, dtype=np.float64),
        np.asarray(coherence > betaincinv(LOCAL * count, (CELL - LOCAL) * count, 1 - SURE)),
    )


def noise_density(power: Array, freedom: int, f: Array, h: float) -> float:
    """Return the one-sided density of the noise: the median of the powers of cells in the upper three quarters.

    The powers are means with `freedom` degrees of freedom. The median of a chi-square distribution lies below its mean,
    which the result takes into account (Wilson & Hilferty 1931).
    """
    top = f >= f.max() / 4
    mean = np.median(power[top]) / (1 - 2 / (9 * freedom)) ** 3
    return float(np.sqrt(2 * h * mean))


def quiet_density(parts: Sequence[Array], h: float) -> float:
    """Return the one-sided density of white noise from fourth differences, which suppress slow signals.

    The result is the median over blocks of rows, so that a few blocks with jumps and corners have no effect.
    """
    rows = np.concatenate([np.diff(x, 4)[: (len(x) - 4) // QUIET * QUIET].reshape(-1, QUIET) for x in parts])
    # a fourth difference has 70 times the variance; its correlation leaves `QUIET_FREEDOM` of `QUIET` rows
    power = np.median(np.mean(rows**2, axis=1)) / 70 / (1 - 2 / (9 * QUIET_FREEDOM)) ** 3
    return float(np.sqrt(2 * h * power))
