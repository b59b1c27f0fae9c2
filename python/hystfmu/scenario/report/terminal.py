"""Scenario results on a terminal: verdicts, failures, changes against the baseline."""

from __future__ import annotations

from collections.abc import Sequence

from hystfmu.report.terminal import table
from hystfmu.scenario.verdict.baseline import CHANGED, Change
from hystfmu.scenario.verdict.result import Result


def verdicts(results: Sequence[Result]) -> str:
    """Return one line per case, or per scenario if there are several, followed by notes and failures."""
    groups: dict[str, list[Result]] = {}
    for r in results:
        groups.setdefault(r.scenario, []).append(r)
    if len(groups) > 1:
        rows = [
            [name, f"{sum(r.passed for r in g)} of {len(g)}", f"{sum(r.seconds for r in g):.2f}"]
            for name, g in groups.items()
        ]
        lines = [table(["scenario", "passed", "seconds"], rows)]
    else:
        rows = [[r.scenario, r.case, "ok" if r.passed else "FAILED", f"{r.seconds:.2f}"] for r in results]
        lines = [table(["scenario", "case", "verdict", "seconds"], rows)]
    failures = [line for r in results for line in (*r.notes, *_shortened(r.failures()))]
    passed = sum(r.passed for r in results)
    return "\n".join([*lines, *failures, f"{passed} of {len(results)} cases passed"])


def _shortened(failures: Sequence[str]) -> list[str]:
    """Keep every exceeded limit, but only the first change against the baseline: the others follow from it."""
    changed = [line for line in failures if CHANGED in line]
    lines = [line for line in failures if CHANGED not in line] + changed[:1]
    if len(changed) > 1:
        lines[-1] += f" (and {len(changed) - 1} more changed)"
    return lines


def changes(found: Sequence[Change], none: str = "the baseline does not change") -> str:
    """Tabulate changes: old value, new value, change in percent of the old value; return `none` without changes."""
    if not found:
        return none

    def cell(v: float | str | None) -> str:
        return "-" if v is None else v if isinstance(v, str) else f"{v:.6g}"

    rows = []
    for c in found:
        share = "-" if c.relative is None else f"{100 * c.relative:+.3g}"
        rows.append([c.title, c.what, cell(c.old), cell(c.new), share])
    return table(["scenario/case", "what", "old", "new", "change %"], rows)
