"""Findings about the linear dynamics in a record: `Evidence` and its `Mode`s."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array


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
