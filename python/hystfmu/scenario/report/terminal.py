"""Scenario results on a terminal: verdicts, failures, changes against the baseline."""

from __future__ import annotations

from collections.abc import Sequence

from hystfmu.report.terminal import table
from hystfmu.scenario.verdict.baseline import CHANGED, Change
from hystfmu.scenario.verdict.result import Result

LOOP = ("Ms dB", "delay margin, steps")
WORST = ("largest Ms dB", "least delay margin, steps")


def verdicts(results: Sequence[Result]) -> str:
    """Return one line per case, or per scenario if there are several, followed by notes and failures."""
    groups: dict[str, list[Result]] = {}
    for r in results:
        groups.setdefault(r.scenario, []).append(r)
    some = any(r.loop is not None for r in results)
    if len(groups) > 1:
        rows = [
            [
                name,
                f"{sum(r.passed for r in g)} of {len(g)}",
                *_worst(g)[: 2 * some],
                f"{sum(r.seconds for r in g):.2f}",
            ]
            for name, g in groups.items()
        ]
        head = ["scenario", "passed", *WORST[: 2 * some], "seconds"]
    else:
        rows = [
            [r.scenario, r.case, "ok" if r.passed else "FAILED", *_worst([r])[: 2 * some], f"{r.seconds:.2f}"]
            for r in results
        ]
        head = ["scenario", "case", "verdict", *LOOP[: 2 * some], "seconds"]
    lines = [table(head, rows)]
    failures = [line for r in results for line in (*r.notes, *_shortened(r.failures()))]
    passed = sum(r.passed for r in results)
    return "\n".join([*lines, *failures, f"{passed} of {len(results)} cases passed"])


def _worst(results: Sequence[Result]) -> list[str]:
    """Return the largest peak and the least delay margin of the loops of cases as text; empty without loops."""
    loops = [r.loop for r in results if r.loop is not None]
    if not loops:
        return ["", ""]
    peaks = [f.Ms_db for f in loops if f.Ms_db is not None]
    margins = [f.delay_steps for f in loops if f.delay_steps is not None]
    if not all(f.stable for f in loops):
        return ["unstable", "unstable"]
    return [f"{max(peaks):.3g}", f"{min(margins):.3g}"]


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
