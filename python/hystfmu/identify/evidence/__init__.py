"""Evidence in a record for linear dynamics after a hysteresis, as numbers with standard errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.identify.evidence.modal_fit import KNOWN_ZETA, Fitted
from hystfmu.identify.evidence.problem import Problem, Seen
from hystfmu.identify.evidence.search import modes
from hystfmu.identify.evidence.spectra import (
    CELL,
    LOCAL,
    Response,
    Window,
    cells_of,
    noise_density,
    quiet_density,
    response,
)

__all__ = ["Evidence", "Mode", "evidence"]

KNOWN_TOLD = 0.5  # the same of its share, with the errors of its shape
OVERDAMPED = 0.5  # damping ratio from which a part below the modes is creep, and one of negative share none
REST_SHAPE = 0.5  # share of a rest that may be the rise of its mode towards its resonance
BENT = 0.5  # error of f_n over the half width of the resonance, for an error of the response there
LEAST_F, LEAST_ZETA_SE, LEAST_SHARE, LEAST_DELAY = 1e-4, 3e-3, 2e-3, 0.05
"""Least standard errors: relative errors of f_n and zeta, error of a share, and error of the delay in steps.

Tests with drawn devices show errors of this size even if the noise allows smaller errors. Modes above the band, and
inputs that are not ramps between rows, cause these errors.
"""


@dataclass(frozen=True)
class Mode:
    """One mode 1/(1 + 2 zeta s/omega_n + s^2/omega_n^2) of the response, with standard errors.

    ``f_n`` is in Hz. ``share`` is the static gain of the mode divided by the static gain of the whole response.
    """

    f_n: float
    zeta: float
    share: float
    f_n_se: float
    zeta_se: float
    share_se: float


@dataclass(frozen=True, eq=False)
class Evidence:
    """Linear dynamics after the hysteresis, as far as a record shows them.

    Attributes
    ----------
    h : float
        Step of the record (s).
    hold : str
        How the input behaves between rows: ``foh`` (ramps), ``smooth`` or ``zoh`` (held at the new value).
    band : tuple of float
        Contiguous band (Hz) from low frequency in which input and output are coherent; (0, 0): none.
    f, gain, phase, coherence, significant : array, shape (n,)
        Frequency response with static gain 1 (phase in rad), coherence, and the level that the coherence of unrelated
        signals exceeds with a probability of 1 %.
    modes : tuple of Mode
        Up to three modes that the record determines, sorted by frequency.
    delay, delay_se : float
        Delay (s) in addition to the modes. If `delay_se` is infinite, the delay is not known.
    noise, noise_density : float
        Noise of the sensor: RMS for white noise (unit of measure of y), and one-sided density (unit of measure of y per
        sqrt(Hz)).
    """

    h: float
    hold: str
    band: tuple[float, float]
    f: Array
    gain: Array
    phase: Array
    coherence: Array
    significant: Array
    modes: tuple[Mode, ...]
    delay: float
    delay_se: float
    noise: float
    noise_density: float

    def lines(self, unit: str = "") -> list[str]:
        """Return the findings in a few lines of text; `unit` is the unit of measure of y."""
        lowest, highest = self.band
        band = f"input and output are coherent from {lowest:.3g} to {highest:.4g} Hz" if highest else "no coherent band"
        of = f" {unit}" if unit not in ("", "1") else ""
        known = np.isfinite(self.noise)
        noise = f"; noise {self.noise:.2g}{of} RMS, {self.noise_density:.2g}{of}/sqrt(Hz)" if known else ""
        modes = [
            f"mode at {_known(m.f_n, m.f_n_se)} Hz, damping ratio {_known(m.zeta, m.zeta_se)}, "
            f"{_known(100 * m.share, 100 * m.share_se)} % of the static gain"
            for m in self.modes
        ]
        late = f"delay {_known(self.delay, self.delay_se)} s" if np.isfinite(self.delay_se) else "delay not known"
        return [f"record: {band}{noise}", *(modes or ["no mode inside this band"]), late]

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers, lists and tables, for a file."""
        out: dict[str, Any] = {}
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                out[item.name] = [float(f"{v:.6g}") for v in value]
            elif item.name == "modes":
                out[item.name] = [asdict(m) for m in value]
            else:
                out[item.name] = list(value) if isinstance(value, tuple) else value
        # JSON has no number for what is not known
        unknown = [k for k, v in out.items() if isinstance(v, float) and not np.isfinite(v)]
        for key in unknown:
            del out[key]
        return out

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> Evidence:
        """Return the evidence from the tables of `to_dict`."""
        unknown = {"delay_se": np.inf, "noise": np.nan, "noise_density": np.nan}
        values: dict[str, Any] = {item.name: {**unknown, **table}[item.name] for item in fields(cls)}
        for key in ("f", "gain", "phase", "coherence", "significant"):
            values[key] = np.asarray(values[key], dtype=np.float64)
        lowest, highest = values["band"]
        values["band"] = (float(lowest), float(highest))
        values["modes"] = tuple(Mode(**m) for m in values["modes"])
        return cls(**values)


def _known(value: float, error: float) -> str:
    """Return a value with its standard error, rounded to the digits that the error leaves certain."""
    digits = max(int(np.ceil(np.log10(abs(value) / error))) + 1, 2) if error > 0 and value else 4
    return f"{value:.{min(digits, 8)}g} +- {error:.2g}"


def evidence(data: Dataset, v: Array | None = None) -> Evidence:
    """Find band, frequency response, modes, delay and noise of records.

    Parameters
    ----------
    data : Dataset
        Data with a measured output; only its training rows are used.
    v : array, shape (n,), optional
        Output of the static hysteresis before the dynamics; default the input.
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
    found = modes(seen)
    hold, fitted = ("smooth", None) if found is None else found
    left = seen.y if fitted is None else fitted.left(Problem(seen, hold))
    density = _density(seen, left)
    r, static = seen.response, _static_gain(seen.response, fitted)
    known, delay, delay_se = _told(fitted, seen, left, density)
    return Evidence(
        h=data.h,
        hold=hold,
        band=r.band(),
        f=r.f,
        gain=np.abs(r.g) / static,
        phase=np.unwrap(np.angle(r.g)) if len(r.g) else np.zeros(0),
        coherence=r.coherence,
        significant=r.level,
        modes=known,
        delay=delay,
        delay_se=delay_se,
        noise=high * density * float(np.sqrt(0.5 / data.h)),
        noise_density=high * density,
    )


def _density(seen: Seen, e: Array) -> float:
    """Return the noise density in spans of y.

    It is the least residual of local responses, of a fit, and of rows at rest.
    """
    left = seen.cells.left / (CELL - LOCAL)
    return min(
        noise_density(left, 2 * (CELL - LOCAL), seen.cells.f, seen.h),
        noise_density(seen.powers(e), 2 * CELL, seen.cells.f, seen.h),
        quiet_density([e[w.rows] for w in seen.windows], seen.h),
    )


def _static_gain(r: Response, found: Fitted | None) -> float:
    """Return the static gain of a fit; without a fit, the median gain of the lowest third of coherent points."""
    if found is not None and found.structure.modes:
        return abs(float(found.gain.sum())) or 1.0
    seen = np.flatnonzero(r.seen)
    return float(np.median(np.abs(r.g[seen[: max(len(seen) // 3, 1)]]))) or 1.0 if len(seen) else 1.0


def _told(found: Fitted | None, seen: Seen, e: Array, density: float) -> tuple[tuple[Mode, ...], float, float]:
    """Return the known modes, sorted by frequency, and the delay with its standard error (s).

    e (n,) is the residual of the fit; `density` is the density of the noise in spans of y.
    """
    h = seen.h
    if found is None:
        return (), 0.0, float("inf")
    m, known = len(found.p), found.known(seen)
    f_n, zeta = np.exp(found.p[: m - 1 : 2]), np.exp(found.p[1 : m - 1 : 2])
    # creep is no part of the static gain of the dynamics
    slow = ~known & (zeta > OVERDAMPED) & (f_n < np.min(f_n[known], initial=np.inf))
    counted = np.append(~slow, found.structure.rest)[: len(found.gain)].astype(bool)
    total = float(found.gain[counted].sum()) or 1.0
    # a rest is a mode above the band, which is larger there than at rest, and so is a mode that is not known
    other = counted.copy()
    other[: len(known)] &= ~known
    rest = float(np.sum(np.abs(found.gain[other])))
    noise, sd = seen.noise(e), np.sqrt(np.diag(found.covariance))
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
