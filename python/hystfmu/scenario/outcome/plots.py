"""Diagrams of one case: loops, recorded signals, the error between samples."""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.report.plot import Line, Plot
from hystfmu.scenario.outcome.excerpt import drawn
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.system.measures import label, unit_of
from hystfmu.scenario.system.system import System


def case_plots(system: System, trace: Trace) -> list[Plot]:
    """What the report shows of a case: as far as it names loops and signals."""
    case = system.case
    after = min((m.after for m in case.metrics.values()), default=0.0)
    window = trace.t >= after
    plots = []
    if case.loops:
        lines = [Line(f"{b} over {a}", _centred(trace[a][window]), _centred(trace[b][window])) for a, b in case.loops]
        plots.append(Plot("Loops, each scaled to its range", "input, scaled", "output, scaled", lines))
    if case.record:
        lines = [Line(s, trace.t, trace[s]) for s in case.record]
        units = {unit_of(system, s) for s in case.record}
        plots.append(Plot("Signals", "t in s", label("value", units.pop() if len(units) == 1 else ""), lines))
    tracked = drawn(case)
    if tracked is not None and tracked.against is not None:
        e = (trace[tracked.signal] - trace[tracked.against])[window]
        stroke = tracked.stroke or float(np.ptp(trace[tracked.against][window]))
        name = f"{tracked.signal} - {tracked.against}"
        line = Line(name, trace.t[window], 100 * e / stroke)
        plots.append(
            Plot("Tracking error, including between samples", "t in s", "percent of stroke", [line], envelope=True)
        )
    return plots


def _centred(v: Array) -> Array:
    """Scale to [-1, 1], so that loops with different units of measure share a plot."""
    lo, hi = float(v.min()), float(v.max())
    return (2 * v - lo - hi) / (hi - lo) if hi > lo else v - lo
