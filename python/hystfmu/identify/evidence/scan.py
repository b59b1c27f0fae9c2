"""Start values of a mode and the delay: a scan of frequency, damping and delay over pooled cross-spectra."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.identify.evidence.spectra import Complex

GRID = 1200  # bins after pooling
DAMPINGS = (0.01, 0.03, 0.1, 0.3, 0.8)


@dataclass(frozen=True)
class Pooled:
    """Weighted spectra at frequencies (n,): |V|^2 and V* Y over the noise."""

    f: Array
    power: Array
    cross: Complex

    @classmethod
    def of(cls, f: Array, v: Complex, y: Complex, weight: Array) -> Pooled:
        """Pool bins, of which the last has the highest frequency."""
        order = np.argsort(f, kind="stable")
        f, power = f[order], (np.abs(v) ** 2 * weight**2)[order]
        cross = (v.conj() * y * weight**2)[order]
        size = -(-len(f) // GRID)
        starts = np.arange(0, len(f), size)
        count = np.diff(np.append(starts, len(f)))
        return cls(np.add.reduceat(f, starts) / count, np.add.reduceat(power, starts), np.add.reduceat(cross, starts))


def mode_response(f: Array, f_n: float | Array, zeta: float | Array) -> Complex:
    """Return 1/(1 + 2 zeta s/omega_n + s^2/omega_n^2) at frequencies (Hz)."""
    x = f / f_n
    return np.asarray(1 / (1 - x * x + 2j * zeta * x))


def scan(
    pooled: Pooled, known: list[Complex], lowest: float, highest: float, h: float, delays: Array
) -> tuple[float, float, float]:
    """Return f_n (Hz), zeta and delay (steps) of the mode that explains most in addition to known responses.

    Parameters
    ----------
    pooled : Pooled
    known : list of array, shape (n,)
        Responses of known modes, slow parts and the rest, without the delay.
    lowest, highest : float
        Bounds of f_n (Hz).
    h : float
        Step (s).
    delays : array, shape (m,)
        Delays to try (steps).
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
