"""Numbers of a run.

With e = signal - against, over the rows at or after `after`, in percent of the stroke:
rms_percent              root mean square of e, between samples included (fine grid)
max_percent              largest |e|, between samples included
between_samples_percent  largest |e| beyond the straight line between its values at the samples: the ripple
variation_ratio          total variation of the signal / that of `against`, at the samples: 1 means no chattering
peak                     largest |signal|
final                    |e| at the end (|signal| without `against`)
loop_area_percent        area that the signal encloses over `against`, of the rectangle of their spans; the window must
                         be one period (an ellipse has at most 78.5, a straight line 0): what hysteresis is left
"""

from __future__ import annotations

import numpy as np

from hystfmu.core import Array
from hystfmu.errors import InputError
from hystfmu.scenario.spec import MetricSpec
from hystfmu.scenario.trace import Trace


def measure(m: MetricSpec, trace: Trace) -> float:
    """One metric of a run.

    Raises
    ------
    InputError
        If the metric needs `against`, or the stroke is zero.
    """
    if m.kind != "peak" and m.kind != "final" and m.against is None:
        raise InputError(f"{m.kind} needs 'against'")
    window = trace.t >= m.after * (1 - 1e-12)
    signal = trace[m.signal][window]
    against = trace[m.against][window] if m.against is not None else np.zeros_like(signal)
    e = signal - against
    if m.kind == "peak":
        return float(np.abs(signal).max())
    if m.kind == "final":
        return float(abs(e[-1]))
    if m.kind == "variation_ratio":
        at = _samples(trace)[window]
        return float(_ratio(np.abs(np.diff(signal[at])).sum(), np.abs(np.diff(against[at])).sum()))
    if m.kind == "loop_area_percent":
        return 100 * _loop_area(against, signal)
    stroke = m.stroke if m.stroke is not None else float(np.ptp(against))
    if stroke == 0:
        raise InputError(f"the stroke is zero: {m.against} does not move; give 'stroke'")
    if m.kind == "rms_percent":
        return float(100 * np.sqrt(np.mean(e**2)) / stroke)
    if m.kind == "max_percent":
        return float(100 * np.abs(e).max() / stroke)
    at = _samples(trace)[window]
    t = trace.t[window]
    return float(100 * np.abs(e - np.interp(t, t[at], e[at])).max() / stroke)


def _loop_area(x: Array, y: Array) -> float:
    """Area of a loop that is closed by a straight line (shoelace formula), as a share of the rectangle of its spans."""
    x, y = x - x[0], y - y[0]
    box = float(np.ptp(x) * np.ptp(y))
    return abs(float(x[:-1] @ y[1:] - x[1:] @ y[:-1])) / 2 / box if box else 0.0


def _samples(trace: Trace) -> Array:
    return np.asarray(np.arange(len(trace.t)) % trace.ripple == 0)


def _ratio(a: float, b: float) -> float:
    return a / b if b else (1.0 if a == 0 else np.inf)
