"""Conditions of a scenario: settings, such as a corner, a signal or a delay, that are stated once for several cases.

A case applies its conditions in the order of its list: later ones have priority, and the case itself has the highest
priority. Without its own text, it has the texts of its conditions.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

from hystfmu.base.errors import InputError
from hystfmu.scenario.system.spec import CaseSpec, ConditionSpec, ScenarioSpec

Spec = TypeVar("Spec", CaseSpec, ScenarioSpec)
_LAST = ("stop", "after", "order")  # the last one that is stated holds


def with_conditions(spec: ScenarioSpec, file: Path) -> ScenarioSpec:
    """Return the scenario with complete cases and without conditions.

    Raises
    ------
    InputError
        A case names an unknown condition.
    """
    cases = [_complete(case, spec, file) if case.conditions else case for case in spec.case]
    return _without_conditions(spec.model_copy(update={"case": cases} if cases else {}))


def _complete(case: CaseSpec, spec: ScenarioSpec, file: Path) -> CaseSpec:
    for name in case.conditions:
        if name not in spec.conditions:
            where = f"{file}: case {case.name}: conditions"
            raise InputError(f"{where}: no condition {name!r}; there are {sorted(spec.conditions)}")
    layers: list[ConditionSpec] = [*(spec.conditions[name] for name in case.conditions), case]
    found: dict[str, Any] = {"text": case.text or ", ".join(c.text for c in layers if c.text)}
    for key in ("set", "units", "connections", "limits"):
        found[key] = {name: value for c in layers for name, value in getattr(c, key).items()}
    for key in _LAST:
        found[key] = next((value for c in reversed(layers) if (value := getattr(c, key)) is not None), None)
    return _without_conditions(
        case.model_copy(update={key: value for key, value in found.items() if value not in (None, "", {})})
    )


def _without_conditions(spec: Spec) -> Spec:
    """Return a copy without conditions, so that a saved file has none."""
    made = spec.model_copy(update={"conditions": type(spec.conditions)()})
    made.model_fields_set.discard("conditions")
    return made
