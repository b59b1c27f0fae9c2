"""Plan of a run: scenarios, their cases, and the baselines for comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hystfmu.base.errors import InputError
from hystfmu.base.near import meant
from hystfmu.scenario.system.case import Case, Scenario, split_end
from hystfmu.scenario.system.inside import scenario_folders
from hystfmu.scenario.system.spec import Scheme
from hystfmu.scenario.system.system import System, build
from hystfmu.scenario.verdict.baseline import Baseline


@dataclass(frozen=True)
class Plan:
    """One scenario: the cases that run, and its baseline (None where there is none, or without guard on a record).

    `strict`: a change, or a case without baseline, is a failure. Without any baseline, as for a scenario built in
    Python or on a first run, and with overridden values, only the limits are tested, and `note` states this.
    """

    scenario: Scenario
    systems: tuple[System, ...]
    baseline: Baseline | None
    strict: bool
    note: str = ""


def read(
    paths: Sequence[str | Path | Scenario], overrides: Mapping[str, Any], coupling: Scheme | None
) -> list[Scenario]:
    """The scenarios, with overrides and coupling of the command line on top; a folder may hold several.

    Raises
    ------
    InputError
        Bad scenario file; an override that does not read 'unit.parameter'.
    """
    for key in overrides:
        split_end(key, "--set")
    changes = dict(overrides)
    scenarios: list[Scenario] = []
    for p in paths:
        if isinstance(p, Scenario):
            scenarios.append(p.changed(changes, coupling))
        else:
            scenarios += [Scenario(folder, changes, coupling) for folder in scenario_folders(Path(p))]
    return scenarios


def plan(
    scenarios: Sequence[Scenario], case: str | Sequence[str] | None, overrides: Mapping[str, Any], record: bool
) -> list[Plan]:
    """Build the cases; all errors of the input are found here, before anything runs.

    Raises
    ------
    InputError
        No case of that name, a model that does not fit, an override that no unit takes, a bad baseline.
    """
    names = dict.fromkeys(c.name for s in scenarios for c in s.cases)
    wanted = (case,) if isinstance(case, str) else names if case is None else case
    if unknown := next((name for name in wanted if name not in names), None):
        raise InputError(f"--case {unknown}: no such case; there are {', '.join(names)}.{meant(unknown, names)}")
    cases = [[c for c in s.cases if c.name in wanted] for s in scenarios]
    if case is None:  # a case that is asked for by its name takes every override
        cases = [[_without_own(s, c) for c in group] for s, group in zip(scenarios, cases, strict=True)]
    built = [tuple(build(c) for c in group) for group in cases]
    _check_overrides(overrides, [s for group in built for s in group])
    strict = not overrides
    return [_plan(s, systems, record, strict) for s, systems in zip(scenarios, built, strict=True)]


def _plan(scenario: Scenario, systems: tuple[System, ...], record: bool, strict: bool) -> Plan:
    if scenario.folder is None:
        return Plan(scenario, systems, None, strict=False)
    if record:  # a guard compares the new values with the old ones
        return Plan(scenario, systems, Baseline.load(scenario.folder) if scenario.spec.guard else None, strict=False)
    baseline = Baseline.load(scenario.folder)
    if baseline is None and any(m.limit is not None for s in systems for m in s.case.metrics.values()):
        note = f"{scenario.spec.name}: no baseline yet: the limits alone decide; --record keeps these results as one"
        return Plan(scenario, systems, None, strict=False, note=note)
    return Plan(scenario, systems, baseline, strict)


def _without_own(scenario: Scenario, case: Case) -> Case:
    """Return the case without absolute overrides of its own settings, so that for example a loop without feedback
    remains one."""
    own = {key for c in scenario.spec.case if c.name == case.name for key in c.set}
    relative = {k for k, v in case.overrides.items() if isinstance(v, str) and v.startswith("*")}
    return replace(case, overrides={k: v for k, v in case.overrides.items() if k not in own - relative})


def _check_overrides(overrides: Mapping[str, Any], systems: Sequence[System]) -> None:
    for key in overrides:
        if not any(key in system.overridden for system in systems):
            known = {name for system in systems for name in system.parameters}
            if key in known:
                raise InputError(f"--set {key}: Some case must take its value from the scenario. Got only own values.")
            raise InputError(
                f"--set {key}: none of the scenarios has a unit with that parameter.{meant(key, sorted(known))}"
            )
