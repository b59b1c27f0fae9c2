"""Problems of a model description: by its schema, by the rules of fmpy, and contradictions that both accept."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hystfmu.fmu.foreign.instance import CARRIED

_RULES = "the rules of fmpy cannot be applied: {}: {}"


def rule_problems(folder: Path, description: Any) -> Iterator[str]:
    """Yield the problems found by the schema and the rules of fmpy, a sentence each.

    Parameters
    ----------
    folder : Path
        The unpacked FMU.
    description : ModelDescription or None
        Read by fmpy without its rules; None if that fails.
    """
    from fmpy import read_model_description
    from fmpy.model_description import ValidationError
    from fmpy.validation import validate_model_description

    try:
        read_model_description(str(folder), validate=True)
    except ValidationError as e:
        yield from map(str, e.problems)
    except Exception as e:
        yield str(e) if description is None else _RULES.format(type(e).__name__, e)
    if description is None:
        return
    # the schema ends what fmpy does above, before its rules; each of the two calls repeats the common ones
    for more in ({"validate_variable_names": True}, {"validate_model_structure": True}):
        try:
            found = validate_model_description(description, **more)
        except Exception as e:  # the rules of fmpy rely on the schema
            found = [_RULES.format(type(e).__name__, e)]
        yield from (re.sub(r'(for naming convention "structured"\.).*', r"\1", str(p), flags=re.DOTALL) for p in found)


def description_problems(description: Any) -> Iterator[str]:
    """Yield a sentence for each contradiction.

    Parameters
    ----------
    description : ModelDescription
        Read by fmpy.
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
