"""Contradictions in a model description that its schema and fmpy accept."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hystfmu.fmu.foreign.instance import CARRIED, interface_of

_INTERFACES = ("CoSimulation", "ModelExchange", "ScheduledExecution")


def description_problems(description: Any, binaries: Path) -> Iterator[str]:
    """Yield a sentence for each contradiction.

    Parameters
    ----------
    description : ModelDescription
        Read by fmpy.
    binaries : Path
        Folder of the binary for this platform.
    """
    for v in description.modelVariables:
        if v.type in CARRIED and v.type != "Boolean":
            yield from _range(v)
    for u in description.unitDefinitions:
        factor = getattr(u.baseUnit, "factor", None) if u.baseUnit is not None else None
        if factor is not None and float(factor) == 0:
            yield f'the unit "{u.name}" has the factor 0 to its base unit'
    experiment = description.defaultExperiment
    if experiment is not None:
        start, stop = float(experiment.startTime or 0), experiment.stopTime
        if stop is not None and float(stop) < start:
            yield f"the default experiment stops at {float(stop):g} s, before its start at {start:g} s"
        if experiment.stepSize is not None and not float(experiment.stepSize) > 0:
            yield f"the step size of the default experiment is {float(experiment.stepSize):g}; it must be positive"
    for title, unknowns in (("Outputs", description.outputs), ("Derivatives", description.derivatives)):
        for name, n in Counter(u.variable.name for u in unknowns).items():
            if n > 1:
                yield f"ModelStructure/{title} lists {name} {n} times"
    for interface in _INTERFACES:
        found = interface_of(description, interface)  # type: ignore[arg-type]
        if found is not None and not any(p.stem == found.modelIdentifier for p in binaries.iterdir()):
            yield f"{interface}: no binary is named after the modelIdentifier {found.modelIdentifier!r}"


def _numbers(text: Any) -> list[float]:
    return [] if text is None else [float(w) for w in str(text).split()]


def _range(v: Any) -> Iterator[str]:
    bounds = [_numbers(b) for b in (v.min, v.max)]
    low, high = (b[0] if b else None for b in bounds)
    if low is not None and high is not None and low > high:
        yield f"{v.name}: the minimum {low:g} is above the maximum {high:g}"
        return
    for x in _numbers(v.start):
        if (low is not None and x < low) or (high is not None and x > high):
            shown = " to ".join("..." if b is None else f"{b:g}" for b in (low, high))
            yield f"{v.name}: the start value {x:g} is outside its range {shown}"
            break
    nominal = _numbers(getattr(v, "nominal", None))
    if nominal and not (math.isfinite(nominal[0]) and nominal[0] > 0):
        yield f"{v.name}: the nominal value is {nominal[0]:g}; it must be positive"
