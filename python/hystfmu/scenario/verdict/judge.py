"""The two verdicts on a run: against the limits (requirement) and against the baseline (change)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.scenario.outcome.metrics import Measure
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.verdict.baseline import CHANGED, ROUNDING, Baseline, Kept, compare


@dataclass(frozen=True)
class Verdict:
    """One metric of one case with both verdicts.

    Parameters
    ----------
    metric, kind : str
        Its name, and what is measured (``"rms_percent"``, ...).
    value : float
        In the unit of measure of its kind.
    limit, baseline : float, optional
        The largest allowed value, which is the smaller of limit and guard, and the recorded value; None if not stated.
    within : bool
        Finite and not above the limit.
    same : bool, optional
        Unchanged from the baseline; None if there is no baseline.
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
    """Both verdicts on every metric, one line per failure (scenario/case, metric, value, limit), and notes.

    Without `strict` only the limits are tested, and changes are notes; otherwise a missing baseline or a change is a
    failure.
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
    """Return the largest allowed value, and a text if it comes from the guard of the scenario."""
    if guard is None or recorded is None:
        return limit, ""
    most = max(guard * abs(recorded), ROUNDING)
    return (limit, "") if limit is not None and limit <= most else (most, f", {guard:g} times the recorded value")
