"""Identification of linear dynamics after a hysteresis: modes, delay, their standard errors, and the sensor noise."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from hystfmu.base import Array
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

KNOWN_TOLD = 0.5  # largest relative standard error of the share of a reported mode
OVERDAMPED = 0.5  # above this damping ratio, a part below all modes counts as creep, and a negative share as no mode
REST_SHAPE = 0.5  # share of the rest column that can be the increase of a higher mode towards its resonance
BENT = 0.5  # error of f_n, relative to half the width of the resonance, per relative error of the response
LEAST_F, LEAST_ZETA_SE, LEAST_SHARE, LEAST_DELAY = 1e-4, 3e-3, 2e-3, 0.05
"""Smallest standard errors: relative errors of f_n and zeta, error of a share, and error of the delay in steps.

In tests with random devices, errors of this size occur even if the noise permits smaller errors. Their causes are modes
above the band and inputs that are not ramps between rows.
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
    """Linear dynamics after the hysteresis that a record determines.

    Attributes
    ----------
    h : float
        Step of the record (s).
    hold : str
        Input between two rows: a ramp (``foh``), a band-limited signal (``smooth``), or constant at the new value
        (``zoh``).
    band : tuple of float
        Lower and upper limit (Hz) of the frequency band in which input and output are coherent. (0, 0) means that there
        is no such band.
    f, gain, phase, coherence, significant : array, shape (n,)
        Frequency (Hz), gain relative to the static gain, phase (rad), coherence, and significance level: the coherence
        of unrelated signals exceeds this level with a probability of 1 %.
    modes : tuple of Mode
        Up to three modes that the record determines, sorted by frequency.
    delay, delay_se : float
        Delay (s) in addition to the modes, and its standard error. If `delay_se` is infinite, the delay is not known.
    noise, noise_density : float
        Noise of the sensor: RMS value for white noise (unit of measure of y), and one-sided density (unit of measure of
        y per sqrt(Hz)).
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
        """Return band, noise, modes and delay as lines of text; `unit` is the unit of measure of y."""
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
        """Return the attributes as a dict of numbers, texts, lists and dicts, which can be written to a JSON file."""
        out: dict[str, Any] = {}
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                out[item.name] = [float(f"{v:.6g}") for v in value]
            elif isinstance(value, tuple):
                out[item.name] = [asdict(v) if isinstance(v, Mode) else v for v in value]
            else:
                out[item.name] = value
        # JSON has no representation of infinity and NaN, so entries that are not known are omitted
        unknown = [k for k, v in out.items() if isinstance(v, float) and not np.isfinite(v)]
        for key in unknown:
            del out[key]
        return out

    @classmethod
    def from_dict(cls, table: Mapping[str, Any]) -> "Evidence":
        """Return the object for a dict `table` that `to_dict` returned."""
        unknown = {"delay_se": np.inf}
        values: dict[str, Any] = {
            item.name: table.get(item.name, unknown.get(item.name, np.nan)) for item in fields(cls)
        }
        for key in ("f", "gain", "phase", "coherence", "significant"):
            values[key] = np.asarray(values[key], dtype=np.float64)
        lowest, highest = values["band"]
        values["band"] = (float(lowest), float(highest))
        values["modes"] = tuple(Mode(**m) for m in values["modes"])
        return cls(**values)


def _known(value: float, error: float) -> str:
    """Return the text of a value with its standard error; the value is rounded according to this error."""
    digits = max(int(np.ceil(np.log10(abs(value) / error))) + 1, 2) if error > 0 and value else 4
    return f"{value:.{min(digits, 8)}g} +- {error:.2g}"


def evidence(data: Dataset, v: Array | None = None) -> Evidence:
    """Identify the coherent band, frequency response, modes, delay and noise of the dynamics from records.

    Parameters
    ----------
    data : Dataset
        Data with a measured output. Only the training rows are used.
    v : array, shape (n,), optional
        Input of the dynamics, which is the output of the static hysteresis. The default is the input of the device.
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
    """Return the one-sided noise density, relative to the span of y.

    The result is the smallest of three estimates: from the residual of the frequency response in each cell of
    neighbouring bins, from the residual e (n,) of the fit with modes, and from the fourth differences of e.
    """
    left = seen.cells.left / (CELL - LOCAL)
    return min(
        noise_density(left, 2 * (CELL - LOCAL), seen.cells.f, seen.h),
        noise_density(seen.powers(e), 2 * CELL, seen.cells.f, seen.h),
        quiet_density([e[w.rows] for w in seen.windows], seen.h),
    )


def _static_gain(r: Response, found: Fitted | None) -> float:
    """Return the static gain of a fit with modes; without modes, the median of the gains at low frequencies."""
    if found is not None and found.structure.modes:
        return abs(float(found.gain.sum())) or 1.0
    seen = np.flatnonzero(r.seen)
    return float(np.median(np.abs(r.g[seen[: max(len(seen) // 3, 1)]]))) or 1.0 if len(seen) else 1.0


def _told(found: Fitted | None, seen: Seen, e: Array, density: float) -> tuple[tuple[Mode, ...], float, float]:
    """Return the modes that the record determines, sorted by frequency, the delay (s), and its standard error (s).

    e (n,) is the residual of the fit `found`. `density` is the noise density, relative to the span of y.
    """
    h = seen.h
    if found is None:
        return (), 0.0, float("inf")
    m, known = len(found.p), found.known(seen)
    f_n, zeta = np.exp(found.p[: m - 1 : 2]), np.exp(found.p[1 : m - 1 : 2])
    # the static gain of the dynamics does not include creep
    slow = ~known & (zeta > OVERDAMPED) & (f_n < np.min(f_n[known], initial=np.inf))
    counted = np.append(~slow, found.structure.rest)[: len(found.gain)].astype(bool)
    total = float(found.gain[counted].sum()) or 1.0
    # the rest column and unknown modes represent modes above the band, whose gain increases towards their resonance
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
    if known.any():  # an error of the response near the lowest mode is also an error of the phase, and so of the delay
        first = int(np.argmin(np.where(known, f_n, np.inf)))
        error = _model_error(seen, noise, density, float(f_n[first]), float(zeta[first]))
        late.append(BENT * error / (2 * np.pi * float(f_n[first]) * h))
    delay_se = float(np.sqrt(np.sum(np.square(late)))) * h
    return tuple(sorted(out, key=lambda mode: mode.f_n)), delay, delay_se


def _model_error(seen: Seen, noise: Array, density: float, f_n: float, zeta: float) -> float:
    """Return the relative error of the fitted response near a mode, minus the part that sensor noise explains."""
    near = np.abs(np.log(seen.cells.f / f_n)) < max(2 * zeta, 0.05)
    if not near.any():
        return 1.0
    excess = float(np.mean(noise[near])) - density**2 / (2 * seen.h)
    power = float(np.mean(seen.cells.total[near])) / CELL
    return float(np.sqrt(max(excess, 0.0) / power)) if power > 0 else 1.0
