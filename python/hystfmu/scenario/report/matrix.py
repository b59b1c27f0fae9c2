"""The matrix of scenarios and cases: metric, verdict and a small curve of the error in each cell."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence, Set
from typing import TYPE_CHECKING

import numpy as np

from hystfmu.base.printable import escape
from hystfmu.report.curve import path
from hystfmu.scenario.outcome.excerpt import drawn
from hystfmu.scenario.outcome.plots import error_of
from hystfmu.scenario.report.worst_and_best import main_verdict, word_of
from hystfmu.scenario.system.measures import label, unit_of_metric
from hystfmu.scenario.verdict.baseline import CHANGED

if TYPE_CHECKING:
    from hystfmu.scenario.verdict.judge import Verdict
    from hystfmu.scenario.verdict.result import Result

COLUMNS = 18  # of a small curve, each from the lowest to the highest error in it
WIDE, HIGH = 72, 20
BAD = ' class="bad"'
CAPTION = (
    "Each cell: the error over time, scaled to its largest value; {names}; the verdict on all metrics. "
    "A cell leads to its case."
)


def place(r: Result) -> str:
    """Return the identity of a case on the page."""
    return escape(f"{r.scenario}/{r.case}")


def matrix(results: Sequence[Result]) -> str:
    """Return a table of cases and scenarios as HTML, rows and columns with most entries first.

    The longer side is vertical.
    """
    scenarios = [name for name, _ in Counter(r.scenario for r in results).most_common()]
    cases = [name for name, _ in Counter(r.case for r in results).most_common()]
    cells = {(r.case, r.scenario): r for r in results}
    down, across, corner = cases, scenarios, "case"
    if len(scenarios) > len(cases):
        cells, down, across, corner = {(s, c): r for (c, s), r in cells.items()}, scenarios, cases, "scenario"
    names = " or ".join(sorted({_name(v) for r in results if (v := main_verdict(r)) is not None}))
    head = "".join(f'<th scope="col">{escape(a)}</th>' for a in across)
    rows = "".join(
        f'<tr><th scope="row">{escape(d)}</th>{"".join(_cell(cells.get((d, a))) for a in across)}</tr>' for d in down
    )
    return (
        f'<p class="lead">{escape(CAPTION.format(names=names))}</p><div class="wide"><table class="matrix">'
        f'<tr><th scope="col">{corner}</th>{head}</tr>{rows}</table></div>'
    )


def _name(v: Verdict) -> str:
    """Return a metric with its kind and unit of measure."""
    kind = v.kind.removesuffix("_percent")
    unit = " in % of the stroke" if kind != v.kind else ""
    return f"{v.metric} ({'RMS' if kind == 'rms' else kind}{unit})"


def _cell(r: Result | None) -> str:
    return "<td></td>" if r is None else f"<td>{linked(r)}</td>"


def linked(r: Result) -> str:
    """Return curve, metric and verdict of a case as a link to it."""
    v = main_verdict(r)
    number = "" if v is None else f"{v.value:.3g} "
    return f'<a class="{"ok" if r.passed else "bad"}" href="#{place(r)}">{_curve(r)}{number}{word_of(r)}</a>'


def _curve(r: Result) -> str:
    """Draw the error; nothing if there is none, or if it is not finite."""
    tracked = drawn(r.system.case)
    if r.trace is None or tracked is None or tracked.against is None:
        return ""
    _, e = error_of(r.trace, tracked)
    most = float(np.max(np.abs(e))) if len(e) else 0.0
    if not np.isfinite(most) or most == 0:
        return ""
    pieces = np.array_split(e / most, min(COLUMNS, len(e)))
    y = np.array([v for piece in pieces for v in (piece.min(), piece.max())])
    x = np.repeat(np.linspace(1, WIDE - 1, len(pieces)), 2)
    d = path(x / 10, (HIGH / 2 - (HIGH / 2 - 1) * y) / 10)  # `path` gives tenths: here whole points
    return f'<svg viewBox="0 0 {WIDE} {HIGH}" aria-hidden="true"><path d="{d}"/></svg>'


def case_table(results: Sequence[Result], curves: bool, shown: Set[str]) -> str:
    """Return the cases of a scenario with all metrics, limits and margins as HTML.

    Parameters
    ----------
    results : sequence of Result
        Of one scenario.
    curves : bool
        Whether a cell shows the curve of the error and links to the case.
    shown : set of str
        Link targets of the cases with a section of their own; other cases have the row itself.
    """
    metrics = {v.metric: r.system.case.metrics[v.metric] for r in results for v in r.verdicts}
    names = [label(k, unit_of_metric(results[0].system, m)) for k, m in metrics.items()]
    loops = any(r.loop is not None for r in results)
    names += ["Ms in dB", "delay margin in steps"] if loops else []
    heads = ["case", "error" if curves else "verdict", *names]
    head = "".join(f'<th scope="col">{escape(h)}</th>' for h in heads)
    rows = "".join(_row(r, list(metrics), loops, curves, place(r) in shown) for r in results)
    return f'<div class="wide"><table class="matrix metrics"><tr>{head}</tr>{rows}</table></div>'


def _row(r: Result, metrics: Sequence[str], loops: bool, curves: bool, shown: bool) -> str:
    found = {v.metric: v for v in r.verdicts}
    fails = any(CHANGED in line for line in r.lines)
    cells = "".join(_metric(found.get(m), fails) for m in metrics)
    if loops:
        cells += "".join(f"<td>{c}</td>" for c in (r.loop.cells() if r.loop is not None else ["", ""]))
    verdict = linked(r) if curves else f'<span class="{"ok" if r.passed else "bad"}">{word_of(r)}</span>'
    text = escape(r.system.case.text)
    name = escape(r.case) + ("" if shown or not text else f" <small>{text}</small>")
    own = "" if shown else f' id="{place(r)}"'
    return f'<tr{own}><th scope="row">{name}</th><td>{verdict}</td>{cells}</tr>'


def _metric(v: Verdict | None, fails: bool) -> str:
    """Return value and limit, with the verdict as the sign between them. `fails`: a change is a failure."""
    if v is None:
        return "<td></td>"
    good = v.within and not (fails and v.same is False)
    limit = "" if v.limit is None else f" <small>{'≤' if v.within else '&gt;'} {v.limit:.4g}</small>"
    changed = f'<small class="was">was {v.baseline:.4g}</small>' if v.same is False else ""
    return f"<td{'' if good else BAD}>{v.value:.4g}{limit}{changed}</td>"
