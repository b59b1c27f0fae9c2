"""First plots of a report: wanted and reached of the worst and of the best case, with the error under them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hystfmu.base.printable import escape
from hystfmu.report.page import figure
from hystfmu.report.plot import Line, Plot
from hystfmu.scenario.outcome.excerpt import drawn
from hystfmu.scenario.outcome.plots import case_plots, error_of, value_label
from hystfmu.scenario.verdict.baseline import CHANGED

if TYPE_CHECKING:
    from hystfmu.scenario.verdict.judge import Verdict
    from hystfmu.scenario.verdict.result import Result

TURNS = 3  # of the reference, on each side of the largest error
TALL, LOW = 220, 150


def main_verdict(r: Result) -> Verdict | None:
    """Return the main metric of a case: the one whose error is drawn, or the first; None if the case stopped."""
    if not r.verdicts:
        return None
    tracked = drawn(r.system.case)
    return next((v for v in r.verdicts if r.system.case.metrics[v.metric] is tracked), r.verdicts[0])


def nearness(r: Result) -> tuple[bool, float]:
    """Return whether a case failed, and the ratio of its metric to its limit."""
    v = main_verdict(r)
    if v is None or not math.isfinite(v.value):
        return True, math.inf
    return not r.passed, v.value / v.limit if v.limit else v.value


def word_of(r: Result) -> str:
    """Return the verdict on a case in a word or two."""
    if r.passed or not r.verdicts:
        return "ok" if r.passed else "stopped"
    if all(v.within for v in r.verdicts):
        return "changed" if any(CHANGED in line for line in r.lines) else "no baseline"
    return "failed"


def worst_and_best(results: Sequence[Result]) -> str:
    """Return the figures as HTML; empty without a recorded trace."""
    shown = sorted((r for r in results if r.trace is not None), key=nearness)
    if not shown:
        return ""
    chosen = [("Worst against its limit:", shown[-1]), ("Best:", shown[0])] if len(shown) > 1 else [("", shown[0])]
    return f'<div class="plots hero">{"".join(_column(name, r) for name, r in chosen)}</div>'


def _column(name: str, r: Result) -> str:
    plots = _plots(r) or (case_plots(r.system, r.trace)[:1] if r.trace is not None else [])
    return f"<div>{_said(name, r)}{''.join(map(figure, plots))}</div>" if plots else ""


def _said(name: str, r: Result) -> str:
    v, title = main_verdict(r), escape(f"{name} {r.system.case.title}".strip())
    if v is None:
        return f'<p><b>{title}</b> <b class="bad">stopped</b></p>'
    unit = " % of the stroke" if v.kind.endswith("_percent") else ""
    limit = "" if v.limit is None else f", limit {v.limit:.4g}"
    word = f'<b class="{"ok" if r.passed else "bad"}">{word_of(r)}</b>'
    return f"<p><b>{title}</b><br/>{escape(v.metric)} {v.value:.3g}{unit}{limit}: {word}</p>"


def _plots(r: Result) -> list[Plot]:
    tracked = drawn(r.system.case)
    if r.trace is None or tracked is None or tracked.against is None:
        return []
    t, e = error_of(r.trace, tracked)
    wanted, reached = (r.trace[s][-len(t) :] for s in (tracked.against, tracked.signal))
    near = _around(wanted, int(np.argmax(np.abs(e))) if np.all(np.isfinite(e)) else len(e) - 1)
    t, e, wanted, reached = t[near], e[near], wanted[near], reached[near]
    lines = [Line("wanted", t, wanted), Line("reached", t, reached)]
    unit = value_label(r.system, [tracked.against, tracked.signal])
    return [
        Plot("wanted and reached, around the largest error", "t in s", unit, lines, height=TALL),
        Plot(
            "error, also between samples",
            "t in s",
            "% of the stroke",
            [Line("reached - wanted", t, e)],
            envelope=True,
            height=LOW,
        ),
    ]


def _around(wanted: np.ndarray, at: int) -> slice:
    """Return the rows between turns of the reference before and after a row."""
    steps = np.diff(wanted)
    moving = np.flatnonzero(steps)
    turns = moving[1:][np.diff(np.sign(steps[moving])) != 0]
    before, behind = turns[turns < at], turns[turns > at]
    first = int(before[-TURNS]) if len(before) >= TURNS else 0
    last = int(behind[TURNS - 1]) + 1 if len(behind) >= TURNS else len(wanted)
    return slice(first, last)
