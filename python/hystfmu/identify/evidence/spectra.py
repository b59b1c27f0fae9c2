"""Nonparametric frequency response, coherence and noise of records.

The Fourier transform of a whole record is divided into cells of eight neighbouring bins. In each cell the model
Y = (g_0 + g_1 f) V + E is fitted (local polynomial method: Pintelon & Schoukens, System Identification, 2nd ed. 2012,
section 7.2). E contains the noise and all other parts of the output that are not a linear response to the input. The
transform of a whole record needs no window function, which could suppress a short chirp. It also has the finest
frequency resolution, which lightly damped modes need.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from scipy.fft import next_fast_len, rfft
from scipy.special import betaincinv

from hystfmu.base import Array, Complex, Mask

CELL, LOCAL = 8, 2  # number of bins and number of complex coefficients of the response in a cell
ALPHA, SURE = 0.01, 1e-5  # false-alarm probability of a coherent point, and of a coherent point after a gap in the band
POINTS = 150  # maximum number of points of the frequency response
LEAST_ROWS = 64
QUIET, QUIET_FREEDOM = 40, 13.9
LEAST_POINTS = 3  # minimum number of coherent points in a band
AGREE = 0.03  # relative change of the response over a gap below which the gap contains no mode


@dataclass(frozen=True)
class Window:
    """Slice of the rows of a record; the number of rows is suitable for a fast Fourier transform."""

    rows: slice

    @classmethod
    def of(cls, rows: slice) -> "Window | None":
        """Return the largest window that ends with the last of `rows`; None if `rows` are too few."""
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
        """Number of cells. The bins at frequency 0 and at half of the sampling rate belong to no cell."""
        return (self.n // 2 - 1) // CELL

    def frequencies(self, h: float) -> Array:
        """Return the frequency (Hz) of each bin in the cells, for rows at a distance of h (s)."""
        return np.arange(1, self.cells * CELL + 1) / (self.n * h)

    def transform(self, x: Array) -> Complex:
        """Return the Fourier transform of signals x, (n,) or (n, m), minus the straight line through their end points.

        The scaling is such that white noise of variance s^2 has the mean power s^2 in each bin.
        """
        x = x[self.rows]
        ends = x[-1] - x[0]
        line = np.linspace(0.0, 1.0, self.n)
        level = x - (line[:, None] * ends if x.ndim > 1 else line * ends)
        return np.asarray(rfft(level, axis=0)[1 : self.cells * CELL + 1] / np.sqrt(self.n))


@dataclass(frozen=True)
class Cells:
    """Cells of all records. Each field has the shape (cells,).

    f is the centre frequency (Hz), g is the frequency response, ``weight`` is the power of the input, ``total`` is the
    power of the output, ``left`` is the power of the residual, and ``noise`` is the smoothed noise power of one bin.
    """

    f: Array
    g: Complex
    weight: Array
    total: Array
    left: Array
    noise: Array


def cells_of(windows: Sequence[Window], h: float, v: Array, y: Array) -> Cells:
    """Fit the frequency response in each cell of all records, for input v (n,), output y (n,) and step h (s)."""
    found = [_cells(w, h, v, y) for w in windows]
    return Cells(*(np.concatenate([getattr(c, column.name) for c in found]) for column in fields(Cells)))


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
    # mean response over the cell; if only few bins have input power, it is more accurate than the value at the centre
    g = np.sum(seen.conj() * out, axis=1) / power
    return Cells(f, g, power, total, left, smooth(left / (CELL - LOCAL)))


def smooth(x: Array) -> Array:
    """Return the moving average of x (cells,) over 2 cells, or 4 % of the frequency if this is more, to each side."""
    k = np.arange(len(x))
    wide = np.maximum(2, (0.04 * k).astype(int))
    total = np.concatenate([[0.0], np.cumsum(x)])
    lo, hi = np.maximum(k - wide, 0), np.minimum(k + wide + 1, len(x))
    return np.asarray(np.maximum((total[hi] - total[lo]) / (hi - lo), 1e-300))


@dataclass(frozen=True)
class Response:
    """Frequency response at the points f (n,), in Hz, and its coherence.

    ``level`` is the coherence that unrelated signals exceed with a probability of 1 %. ``sure`` is True at points whose
    coherence unrelated signals exceed with a probability below 1e-5.
    """

    f: Array
    g: Complex
    coherence: Array
    level: Array
    sure: Mask

    @property
    def seen(self) -> Mask:
        """True at the points where input and output are coherent, that is, where the coherence exceeds `level`."""
        return self.coherence > self.level

    def band(self) -> tuple[float, float]:
        """Return the lower and upper limit (Hz) of the coherent band, or (0, 0) if there is no such band.

        The band ends at the first gap that can contain a mode. A gap of at most one octave is permitted, because a mode
        inside it affects the response at its two ends. A wider gap is permitted only if the response is equal on both
        sides, because a mode inside the gap changes the response by twice its share of the static gain.
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
        # at low frequencies, unrelated signals can be coherent because the line through their ends is subtracted
        if np.sum(self.seen[first : last + 1]) < LEAST_POINTS:
            return 0.0, 0.0
        return float(self.f[first]), float(self.f[last])

    def _agree(self, last: int, k: int) -> bool:
        sure = np.flatnonzero(self.sure)
        below, above = (np.abs(self.g[s]) for s in (sure[sure <= last][-3:], sure[sure >= k][:3]))
        return len(above) == 3 and bool(abs(np.mean(above) / np.mean(below) - 1) < AGREE)


def response(cells: Cells) -> Response:
    """Return the frequency response of all cells, averaged to at most `POINTS` logarithmically spaced frequencies."""
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
    """Return the one-sided noise density from the median power of the cells in the upper three quarters of the band.

    `power` contains the mean power of each cell, with `freedom` degrees of freedom, and f contains the centre
    frequencies (Hz). h is the step (s). The median of a chi-square distribution is smaller than its mean; this
    difference is corrected (Wilson & Hilferty 1931).
    """
    top = f >= f.max() / 4
    mean = np.median(power[top]) / (1 - 2 / (9 * freedom)) ** 3
    return float(np.sqrt(2 * h * mean))


def quiet_density(parts: Sequence[Array], h: float) -> float:
    """Return the one-sided density of white noise from fourth differences of signals, which suppress slow changes.

    `parts` contains the signals, and h is the step (s). The result is the median over blocks of `QUIET` rows, so that a
    few blocks with jumps and kinks have no effect.
    """
    rows = np.concatenate([np.diff(x, 4)[: (len(x) - 4) // QUIET * QUIET].reshape(-1, QUIET) for x in parts])
    # the fourth difference of white noise has 70 times its variance; `QUIET` correlated rows have `QUIET_FREEDOM`
    # degrees of freedom
    power = np.median(np.mean(rows**2, axis=1)) / 70 / (1 - 2 / (9 * QUIET_FREEDOM)) ** 3
    return float(np.sqrt(2 * h * power))
