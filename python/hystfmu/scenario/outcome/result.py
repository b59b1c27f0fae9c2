"""Result of one case of a scenario: verdicts against limits and baseline, failures, signals for plots."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.scenario.outcome.baseline import CHANGED, ROUNDING, Baseline, Kept, compare
from hystfmu.scenario.outcome.metrics import Measure
from hystfmu.scenario.outcome.trace import Sweeps, Trace
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.system import System


@dataclass(frozen=True)
class Verdict:
    """One metric of one case, with the verdicts against limit and baseline.

    Parameters
    ----------
    metric, kind : str
        Name of the metric, and kind of metric (``"rms_percent"``, ...).
    value : float
        Value in the unit of measure of its kind.
    limit, baseline : float, optional
        `limit` is the largest allowed value, which is the smaller of limit and guard. `baseline` is the recorded value.
        None means that the value is not stated.
    within : bool
        Whether the value is finite and not above the limit.
    same : bool, optional
        Whether the value is unchanged from the baseline; None if there is no baseline.
    """

    metric: str
    kind: str
    value: float
    limit: float | None
    baseline: float | None
    within: bool
    same: bool | None


def judge(
    case: Case, measured: Mapping[str, Measure], kept: Kept, baseline: Baseline | None, strict: bool = True
) -> tuple[list[Verdict], list[str], list[str]]:
    """Return the verdicts on every metric, one line per failure (scenario/case, metric, value, limit), and notes.

    With `strict`, a missing baseline or a change is a failure. Without `strict`, only the limits are tested, and
    changes are notes.
    """
    known = baseline.metrics.get(case.name) if baseline is not None else None
    verdicts: list[Verdict] = []
    failures: list[str] = []
    changed: list[str] = []
    for name, m in case.metrics.items():
        try:
            value = measured[name].value()
        except InputError as e:
            raise InputError(f"{case.where}: metrics.{name}: {e}") from None
        old = known.get(name) if known is not None else None
        limit, stated = _allowed(case.guard, m.limit, old)
        within = bool(np.isfinite(value)) and (limit is None or value <= limit)
        same = None
        if old is not None:
            same = abs(value - old) <= max(case.tolerance * max(abs(old), m.limit or 0.0), ROUNDING)
        verdicts.append(Verdict(name, m.kind, value, limit, old, within, same))
        if not within:
            rule = "is not finite" if limit is None else f"exceeds the limit {limit:.6g}{stated}"
            failures.append(f"{case.title}: {name} ({m.kind} of {m.signal}) = {value:.6g} {rule}")
        if same is False:
            advice = "; if that is meant, run with --record" if strict else ""
            changed.append(
                f"{case.title}: {name} = {value:.9g} {CHANGED} {old:.9g} (tolerance {case.tolerance:g}){advice}"
            )
    if known is not None and set(known) == set(case.metrics) and baseline is not None:
        changed += compare(case, kept, baseline)
    elif strict:
        changed.append(f"{case.title}: no baseline: run with --record")
    return (verdicts, failures + changed, []) if strict else (verdicts, failures, changed)


def _allowed(guard: float | None, limit: float | None, recorded: float | None) -> tuple[float | None, str]:
    """Return the largest allowed value. If the guard of the scenario determines it, also return a text."""
    if guard is None or recorded is None:
        return limit, ""
    most = max(guard * abs(recorded), ROUNDING)
    return (limit, "") if limit is not None and limit <= most else (most, f", {guard:g} times the recorded value")


MOST_SAID = 3  # metrics in the repr


@dataclass(frozen=True)
class LoopFigures:
    """Margins of the linearised loop of a case for its nominal slope. For an unstable loop they are None.

    Attributes
    ----------
    stable : bool
    Ms_db : float or None
        Peak of the sensitivity (dB).
    delay_steps : float or None
        Delay margin in addition to the delay of the case (steps). It may be infinite.
    """

    stable: bool
    Ms_db: float | None
    delay_steps: float | None

    def summary(self) -> dict[str, bool | float | None]:
        """Return the figures as JSON types. An infinite delay margin is None, because JSON has no infinity."""
        return vars(self) | {"delay_steps": None if self.delay_steps == math.inf else self.delay_steps}

    def cells(self) -> list[str]:
        """Return peak and delay margin as text."""
        return ["unstable" if x is None else f"{x:.3g}" for x in (self.Ms_db, self.delay_steps)]


@dataclass(frozen=True)
class CaseResult:
    """Verdicts, failures and signals of one case after its run; `hystfmu.scenario.Result` states the fields."""

    system: System
    verdicts: tuple[Verdict, ...]
    lines: tuple[str, ...]
    trace: Trace | None
    seconds: float
    notes: tuple[str, ...] = ()
    counted: Sweeps = field(default_factory=Sweeps)
    loop: LoopFigures | None = None

    def __repr__(self) -> str:
        if not self.verdicts:
            return f"Result({self.system.case.title!r}, stopped: {self.lines[0]})"
        return (
            f"Result({', '.join([repr(self.system.case.title), 'passed' if self.passed else 'failed', *self._said()])})"
        )

    def _said(self) -> list[str]:
        """Return one line with the first metrics and their limits."""
        said = []
        for v in self.verdicts[:MOST_SAID]:
            percent = " %" if v.kind.endswith("_percent") else ""
            limit = "" if v.limit is None else f" {'<=' if v.within else '>'} {v.limit:g}"
            said.append(f"{v.metric} = {v.value:.4g}{percent}{limit}")
        return [*said, "..."] if len(self.verdicts) > MOST_SAID else said

    @property
    def scenario(self) -> str:
        """Name of the scenario."""
        return self.system.case.scenario

    @property
    def case(self) -> str:
        """Name of the case."""
        return self.system.case.name

    @property
    def passed(self) -> bool:
        """True if all limits are met and nothing differs from the baseline."""
        return not self.lines

    def failures(self) -> list[str]:
        """Return one line per failure."""
        return list(self.lines)

    @property
    def sweeps(self) -> dict[str, Any]:
        """Method, mean and largest number of sweeps in a step for an iterative coupling; otherwise empty."""
        s = self.counted
        if not s.steps:
            return {}
        method = "newton" if self.system.newton else "relaxation"
        return {"method": method, "mean": s.all / s.steps, "most": s.most}

    def summary(self) -> dict[str, Any]:
        """Return verdicts, failures, seconds, and sweeps of an iterative coupling as JSON types."""
        return {
            "scenario": self.scenario,
            "case": self.case,
            "passed": self.passed,
            "seconds": round(self.seconds, 4),
            "metrics": [vars(v) for v in self.verdicts],
            "failures": list(self.lines),
            "notes": list(self.notes),
            "margins": None if self.loop is None else self.loop.summary(),
        } | ({"sweeps": self.sweeps} if self.sweeps else {})
