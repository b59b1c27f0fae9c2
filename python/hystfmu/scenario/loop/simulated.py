"""Delay margin by simulation. It is for loops whose gain depends on the amplitude, which have no linear margin.

A delay of whole fine steps is added after the command. Bisection finds the largest delay for which the case does not
fail. The case fails if the run stops, if the error grows, or if the error is far above the error without this delay.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.build import build
from hystfmu.scenario.system.spec import UnitSpec
from hystfmu.scenario.system.system import Link, System

MOST = 4  # steps
GROWTH = 1.5  # references whose errors differ from half to half
FAR = 0.005  # of the stroke
NAME = "further_delay"


def simulated_delay(system: System, entry: Link, growth: float = GROWTH, far: float = FAR) -> float:
    """Return the largest further delay for which a case does not fail, in steps, up to `MOST`.

    Return NaN if the case fails without further delay. `entry` is the connection of the command to the units at the
    rate of the plant. The largest error may grow by the factor `growth` from the first to the second half of the window
    of the metric. Relative to the stroke, the error may be `far` above the error without further delay.
    """
    ripple = system.case.ripple
    first = _errors(system)
    if first is None or first[1] > growth * first[0]:
        return float("nan")
    most = max(first) + far
    holds, fails = 0, MOST * ripple + 1
    while fails - holds > 1:
        n = (holds + fails) // 2
        found = _errors(_delayed(system, entry, n))
        if found is None or found[1] > growth * found[0] or max(found) > most:
            fails = n
        else:
            holds = n
    return holds / ripple


def _delayed(system: System, entry: Link, n: int) -> System:
    """Insert a delay of n fine steps into a connection. The delay steps after the unit that it reads."""
    case, maker, reader = system.case, system.maker(entry), system.parts[entry.to]
    at = case.order.index(maker.name) + 1
    end = f"{reader.name}.{reader.inputs[entry.input]}"
    unit = UnitSpec.model_validate({"block": "delay", "dims": {"n": n}, "fine": case.ripple > 1})
    connections = case.connections | {end: f"{NAME}.y", f"{NAME}.u": case.connections[end]}
    units = case.units | {NAME: unit}
    changed = replace(case, units=units, order=(*case.order[:at], NAME, *case.order[at:]), connections=connections)
    return build(changed)


def _errors(system: System) -> tuple[float, float] | None:
    """Return the largest error, relative to the stroke, in each half of the window of the metric; None after a stop."""
    metric = next(m for m in system.case.metrics.values() if m.against is not None)
    ends = [metric.signal, str(metric.against)]
    try:
        trace = Native(system, ends).run()
    except Stopped:
        return None
    y, r = (trace[end][trace.t >= metric.after] for end in ends)
    error = np.abs(y - r) / (metric.stroke or float(np.ptp(r)) or 1.0)
    half = len(error) // 2
    return float(error[:half].max()), float(error[half:].max())
