"""Scenario results for a terminal: verdicts, failures, and changes from the baseline."""

import math
from collections.abc import Sequence

from hystfmu.report.terminal import table
from hystfmu.scenario.outcome.result import CHANGED, CaseResult, Change, Verdict, grouped

LOOP = ("Ms dB", "delay margin, steps")
DECISIVE = ("metric", "value", "limit")
WORST = ("largest Ms dB", "least delay margin, steps")


def verdicts(results: Sequence[CaseResult]) -> str:
    """Return one line per case, or per scenario if there are several scenarios, and then notes and failures.

    Each of these lines shows the metric with the largest ratio to its limit.
    """
    groups = grouped(results, lambda r: r.scenario)
    loops = any(r.loop is not None for r in results)
    if len(groups) > 1:
        rows = []
        for name, g in groups.items():
            worst, seconds = max(g, key=_strain), f"{sum(r.seconds for r in g):.2f}"
            count = f"{sum(r.passed for r in g)} of {len(g)}"
            rows.append([name, count, worst.case, *_cells(decisive(worst)), *(_worst(g) if loops else ()), seconds])
        head = ["scenario", "passed", "nearest to a limit", *DECISIVE, *(WORST if loops else ()), "seconds"]
    else:
        rows = [
            [
                r.scenario,
                r.case,
                "ok" if r.passed else "FAILED",
                *_cells(decisive(r)),
                *(_worst([r]) if loops else ()),
                f"{r.seconds:.2f}",
            ]
            for r in results
        ]
        head = ["scenario", "case", "verdict", *DECISIVE, *(LOOP if loops else ()), "seconds"]
    lines = [table(head, rows, keys=1 if len(groups) > 1 else 2)]
    notes = _shortened([line for r in results for line in r.notes])
    failures = dict.fromkeys([*notes, *(line for r in results for line in _shortened(r.failures()))])
    passed = sum(r.passed for r in results)
    return "\n".join([*lines, *failures, f"{passed} of {len(results)} cases passed"])


def every_metric(results: Sequence[CaseResult]) -> str:
    """Return a table of every metric of every case, with the limit and the baseline."""
    rows = [
        [
            r.scenario,
            r.case,
            "ok" if v.within else "FAILED",
            *_cells(v),
            "" if v.baseline is None else f"{v.baseline:.4g}",
        ]
        for r in results
        for v in r.verdicts
    ]
    return table(["scenario", "case", "verdict", *DECISIVE, "baseline"], rows, keys=2)


def decisive(result: CaseResult) -> Verdict | None:
    """Return the metric with the largest ratio to its limit, or the first metric if there are no limits.

    Return None if a unit stopped the run, because there are no metrics then.
    """
    limited = [v for v in result.verdicts if v.limit is not None or not v.within]
    return max(limited, key=_ratio, default=None) or next(iter(result.verdicts), None)


def _ratio(v: Verdict) -> float:
    """Return the ratio of a metric to its limit, or infinity if the metric is not finite."""
    if not math.isfinite(v.value):
        return math.inf
    if v.limit is None or v.limit == 0:
        return 0.0 if v.within else math.inf
    return v.value / v.limit


def _strain(result: CaseResult) -> float:
    found = decisive(result)
    return math.inf if found is None else _ratio(found)


def _cells(v: Verdict | None) -> list[str]:
    if v is None:
        return ["stopped", "", ""]
    percent = " %" if v.kind.endswith("_percent") else ""
    return [f"{v.metric}{percent}", f"{v.value:.4g}", "" if v.limit is None else f"{v.limit:.4g}"]


def _worst(results: Sequence[CaseResult]) -> list[str]:
    """Return the largest peak and the smallest delay margin over the loops of cases as text, or ""."""
    loops = [r.loop for r in results if r.loop is not None]
    if not loops:
        return ["", ""]
    peaks = [f.Ms_db for f in loops if f.Ms_db is not None]
    margins = [f.delay_steps for f in loops if f.delay_steps is not None]
    if not all(f.stable for f in loops):
        return ["unstable", "unstable"]
    return [f"{max(peaks):.3g}", f"{min(margins):.3g}"]


def _shortened(failures: Sequence[str]) -> list[str]:
    """Return the lines of all exceeded limits, but only the first change from the baseline."""
    changed = [line for line in failures if CHANGED in line]
    lines = [line for line in failures if CHANGED not in line] + changed[:1]
    if len(changed) > 1:
        lines[-1] += f" (and {len(changed) - 1} more changed)"
    return lines


def changes(found: Sequence[Change], none: str = "the baseline does not change") -> str:
    """Return a table of old values, new values and changes in percent, or `none` if there are no changes."""
    if not found:
        return none

    def cell(v: float | str | None) -> str:
        return "-" if v is None else v if isinstance(v, str) else f"{v:.6g}"

    rows = []
    for c in found:
        share = "-" if c.relative is None else f"{100 * c.relative:+.3g}"
        rows.append([c.title, c.what, cell(c.old), cell(c.new), share])
    return table(["scenario/case", "what", "old", "new", "change %"], rows)
