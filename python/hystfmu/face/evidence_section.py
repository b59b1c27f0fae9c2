"""Section of a page: frequency response and coherence of a record. Shading marks the band without excitation."""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.face.summary import evidence_lines
from hystfmu.model import Model
from hystfmu.report.page import Section, Table
from hystfmu.report.plot import Line, Plot

FREQUENCY = "frequency (Hz)"
LEAST_GAIN = 1e-4
TEXT = (
    "Frequency response from the output of the hysteresis to the measured output, divided by its static gain, and "
    "coherence, with the coherence that chance exceeds in 1 %. The record gives no information about the device in the "
    "shaded band. +- is one standard error."
)


def evidence_section(model: Model) -> list[Section]:
    """Return the section in a list; the list is empty for a model without evidence."""
    if "evidence" not in model.fit:
        return []
    from hystfmu.identify.evidence import Evidence

    e = Evidence.from_dict(model.fit["evidence"])
    if not len(e.f):
        return []
    x, gain = e.f, 20 * np.log10(np.maximum(e.gain, LEAST_GAIN))
    lines = [Line("measured", x, gain)]
    if e.modes:
        at = np.array([m.f_n for m in e.modes])
        lines.append(Line("modes", at, np.interp(at, x, gain), dots=True))
    dark = _dark(x, e.band, float(gain.min()), float(gain.max()))
    rows = [
        (k, *(f"{v:.3g}" for v in (m.f_n, m.f_n_se, m.zeta, m.zeta_se, 100 * m.share, 100 * m.share_se)))
        for k, m in enumerate(e.modes, 1)
    ]
    table = Table(("mode", "f_n (Hz)", "+-", "damping ratio", "+-", "share of the static gain (%)", "+-"), rows)
    plots = [
        Plot("frequency response", FREQUENCY, "gain (dB)", [*lines, *dark], log_x=True),
        Plot(
            "coherence",
            FREQUENCY,
            "coherence",
            [Line("coherence", x, e.coherence), Line("chance", x, e.significant), *_dark(x, e.band, 0.0, 1.0)],
            log_x=True,
        ),
    ]
    text = " ".join(f"{line[:1].upper()}{line[1:]}." for line in evidence_lines(model))
    return [Section("Evidence", f"{text} {TEXT}", [table] if rows else [], plots)]


def _dark(x: Array, band: tuple[float, float], low: float, high: float) -> list[Line]:
    """Return the shaded area above the coherent band, from the height `low` to the height `high`."""
    first = float(band[1]) if band[1] > 0 else float(x[0])
    if first >= x[-1]:
        return []
    return [Line("not excited", np.array([first, first, x[-1], x[-1]]), np.array([low, high, high, low]), shade=True)]
