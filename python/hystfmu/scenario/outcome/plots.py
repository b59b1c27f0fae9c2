"""Diagrams of one case: loops, recorded signals, the error between samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.report.plot import Line, Plot
from hystfmu.scenario.outcome.excerpt import drawn
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.system.measures import label, unit_of
from hystfmu.scenario.system.spec import MetricSpec
from hystfmu.scenario.system.system import System


def case_plots(system: System, trace: Trace) -> list[Plot]:
    """Plots of a case in the report: the named loops and signals.

    Signals with the same unit of measure share a plot.
    """
    case = system.case
    after = min((m.after for m in case.metrics.values()), default=0.0)
    window = trace.t >= after
    plots = []
    if case.loops:
        lines = [Line(f"{b} over {a}", _share(trace[a][window]), _share(trace[b][window])) for a, b in case.loops]
        plots.append(Plot("Loops, each over its range", "input in % of its range", "output in % of its range", lines))
    units: dict[str, list[str]] = {}
    for s in case.record:
        units.setdefault(unit_of(system, s), []).append(s)
    for signals in units.values():
        lines = [Line(s, trace.t, trace[s]) for s in signals]
        plots.append(Plot(", ".join(signals), "t in s", value_label(system, signals), lines))
    tracked = drawn(case)
    if tracked is not None and tracked.against is not None:
        line = Line(f"{tracked.signal} - {tracked.against}", *error_of(trace, tracked))
        plots.append(Plot("Tracking error, including between samples", "t in s", "% of the stroke", [line], True))
    return plots


def error_of(trace: Trace, tracked: MetricSpec) -> tuple[Array, Array]:
    """Return times (s) and error (% of the stroke) of a metric with `against`, in its window, each of shape (n,)."""
    against = tracked.against or tracked.signal
    window = trace.t >= tracked.after
    e = (trace[tracked.signal] - trace[against])[window]
    stroke = tracked.stroke or float(np.ptp(trace[against][window])) or 1.0
    return trace.t[window], 100 * e / stroke


def value_label(system: System, signals: Sequence[str]) -> str:
    """Return the label of an axis of signals: their unit of measure, if they share one that is stated."""
    units = {unit_of(system, s) for s in signals}
    return label("value", units.pop() if len(units) == 1 else "")


def _share(v: Array) -> Array:
    """Scale to 0 ... 100, so that loops with different units of measure share a plot."""
    lo, hi = float(v.min()), float(v.max())
    return 100 * (v - lo) / (hi - lo) if hi > lo else 50 + v - lo
