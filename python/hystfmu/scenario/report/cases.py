"""Cases on a report page: diagrams of the worst and the best case, and the table of all scenarios and cases."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence, Set

import numpy as np

from hystfmu.base import Array, escape
from hystfmu.report.axis import path
from hystfmu.report.page import figure, figure_of
from hystfmu.report.plot import Line, Plot
from hystfmu.scenario.outcome.metrics import label, unit_of, unit_of_metric
from hystfmu.scenario.outcome.result import CHANGED, CaseResult, Verdict, grouped
from hystfmu.scenario.outcome.trace import Trace, drawn
from hystfmu.scenario.system.spec import MetricSpec
from hystfmu.scenario.system.system import System


def case_plots(system: System, trace: Trace) -> list[Plot]:
    """Return the plots of a case: first the error, then hysteresis loops, then signals."""
    case = system.case
    after = min((m.after for m in case.metrics.values()), default=0.0)
    window = trace.t >= after
    plots = []
    tracked = drawn(case)
    if tracked is not None and tracked.against is not None:
        line = Line(f"{tracked.signal} - {tracked.against}", *error_of(trace, tracked))
        plots.append(Plot("Tracking error, including between samples", "t in s", "% of the stroke", [line], True))
    if case.loops:
        lines = [Line(f"{b} over {a}", _share(trace[a][window]), _share(trace[b][window])) for a, b in case.loops]
        plots.append(Plot("Loops, each over its range", "input in % of its range", "output in % of its range", lines))
    for signals in grouped(case.record, lambda s: unit_of(system, s)).values():
        lines = [Line(s, trace.t, trace[s]) for s in signals]
        plots.append(Plot(", ".join(signals), "t in s", value_label(system, signals), lines))
    return plots


def compared(reached: Mapping[str, tuple[Array, Array, Array]], unit: str, points: int) -> list[Plot]:
    """Return plots of reached over wanted outputs, then of the errors over time.

    `reached` contains time (s), wanted and reached output, each of shape (n,), by the title of a plot. `unit` follows
    the labels. `points` is the largest number of points of a loop.
    """
    loops = [
        Plot(title, f"wanted{unit}", f"reached{unit}", [Line("reached", r, y)], points=points)
        for title, (_, r, y) in reached.items()
    ]
    return loops + [
        Plot(f"error {title}", "time (s)", f"error{unit}", [Line("reached - wanted", t, y - r)], envelope=True)
        for title, (t, r, y) in reached.items()
    ]


def error_of(trace: Trace, tracked: MetricSpec) -> tuple[Array, Array]:
    """Return times (s) and error (% of the stroke) of a metric with `against`, in its window, each of shape (n,)."""
    against = tracked.against or tracked.signal
    window = trace.t >= tracked.after
    e = (trace[tracked.signal] - trace[against])[window]
    stroke = tracked.stroke or float(np.ptp(trace[against][window])) or 1.0
    return trace.t[window], 100 * e / stroke


def value_label(system: System, signals: Sequence[str]) -> str:
    """Return the label of an axis of signals: their common unit of measure, if there is one."""
    units = {unit_of(system, s) for s in signals}
    return label("value", units.pop() if len(units) == 1 else "")


def _share(v: Array) -> Array:
    """Return values scaled to 0 ... 100, so that one plot can show loops with different units of measure."""
    lo, hi = float(v.min()), float(v.max())
    return 100 * (v - lo) / (hi - lo) if hi > lo else 50 + v - lo


TURNS = 3  # number of turns of the reference in the plot, on each side of the largest error
# heights of the plot of curves that look equal, and of the main plot below, which shows their difference
LOW, TALL = 130, 250


def main_verdict(r: CaseResult) -> Verdict | None:
    """Return the verdict on the plotted metric or, without a plot, on the first metric. None if the case stopped."""
    if not r.verdicts:
        return None
    tracked = drawn(r.system.case)
    return next((v for v in r.verdicts if r.system.case.metrics[v.metric] is tracked), r.verdicts[0])


def nearness(r: CaseResult) -> tuple[bool, float]:
    """Return a sort key for cases: whether the case failed, and the ratio of the main metric to the limit."""
    v = main_verdict(r)
    if v is None or not math.isfinite(v.value):
        return True, math.inf
    return not r.passed, v.value / v.limit if v.limit else v.value


def word_of(r: CaseResult) -> str:
    """Return the verdict on a case in one or two words."""
    if r.passed or not r.verdicts:
        return "ok" if r.passed else "stopped"
    if all(v.within for v in r.verdicts):
        return "changed" if any(CHANGED in line for line in r.lines) else "no baseline"
    return "failed"


def worst_and_best(results: Sequence[CaseResult]) -> str:
    """Return the diagrams of the worst and the best case as HTML, or "" if no case has a trace."""
    shown = sorted((r for r in results if r.trace is not None), key=nearness)
    if not shown:
        return ""
    shown = [r for r in shown if (v := main_verdict(r)) is None or v.limit] or shown  # no cases for comparison
    chosen = [("Worst against its limit:", shown[-1]), ("Best:", shown[0])] if len(shown) > 1 else [("", shown[0])]
    return f'<div class="plots hero">{"".join(_column(name, r) for name, r in chosen)}</div>'


def _column(name: str, r: CaseResult) -> str:
    plots = _plots(r) or (case_plots(r.system, r.trace)[:1] if r.trace is not None else [])
    return f"<div>{_said(name, r)}{''.join(map(figure, plots))}</div>" if plots else ""


def _said(name: str, r: CaseResult) -> str:
    v, title = main_verdict(r), escape(f"{name} {r.system.case.title}".strip())
    if v is None:
        return f'<p><b>{title}</b> <b class="bad">stopped</b></p>'
    unit = " % of the stroke" if v.kind.endswith("_percent") else ""
    limit = "" if v.limit is None else f", limit {v.limit:.3g}"
    word = f'<b class="{"ok" if r.passed else "bad"}">{word_of(r)}</b>'
    return f"<p><b>{title}</b><br/>{escape(v.metric)} {escape(figure_of(v.value, v.kind))}{unit}{limit}: {word}</p>"


def _plots(r: CaseResult) -> list[Plot]:
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
        Plot("wanted and reached, around the largest error", "t in s", unit, lines, height=LOW),
        Plot(
            "error, also between samples",
            "t in s",
            "% of the stroke",
            [Line("reached - wanted", t, e)],
            envelope=True,
            height=TALL,
        ),
    ]


def _around(wanted: np.ndarray, at: int) -> slice:
    """Return the rows from `TURNS` reversals of the reference before the row `at` to `TURNS` reversals after it."""
    steps = np.diff(wanted)
    moving = np.flatnonzero(steps)
    turns = moving[1:][np.diff(np.sign(steps[moving])) != 0]
    before, behind = turns[turns < at], turns[turns > at]
    first = int(before[-TURNS]) if len(before) >= TURNS else 0
    last = int(behind[TURNS - 1]) + 1 if len(behind) >= TURNS else len(wanted)
    return slice(first, last)


COLUMNS = 18  # number of columns in a small curve; each column spans the errors in its interval
WIDE, HIGH = 72, 20
BAD = ' class="bad"'
MOST_CURVES = 800  # largest number of cases with curves in the matrix; each curve adds 250 bytes to the page
CAPTION = "Each cell: {shown}; the verdict on all metrics. A cell leads to its case."
CURVE = "the error over time, scaled to its largest value; "


def place(r: CaseResult) -> str:
    """Return the id of a case on the page."""
    return escape(f"{r.scenario}/{r.case}")


def matrix(results: Sequence[CaseResult]) -> str:
    """Return the table of cases and scenarios as HTML. The rows and columns with most entries are first.

    The longer one of the two lists is vertical.
    """
    scenarios = [name for name, _ in Counter(r.scenario for r in results).most_common()]
    cases = [name for name, _ in Counter(r.case for r in results).most_common()]
    cells = {(r.case, r.scenario): r for r in results}
    down, across, corner = cases, scenarios, "case"
    if len(scenarios) > len(cases):
        cells, down, across, corner = {(s, c): r for (c, s), r in cells.items()}, scenarios, cases, "scenario"
    names = " or ".join(sorted({_name(v) for r in results if (v := main_verdict(r)) is not None}))
    curves = len(results) <= MOST_CURVES
    caption = CAPTION.format(shown=(CURVE if curves else "") + names)
    head = "".join(f'<th scope="col">{escape(a)}</th>' for a in across)
    rows = "".join(
        f'<tr><th scope="row">{escape(d)}</th>{"".join(_cell(cells.get((d, a)), curves) for a in across)}</tr>'
        for d in down
    )
    return (
        f'<p class="lead">{escape(caption)}</p><div class="wide"><table class="matrix">'
        f'<tr><th scope="col">{corner}</th>{head}</tr>{rows}</table></div>'
    )


def _name(v: Verdict) -> str:
    """Return the name of a metric with its kind and unit of measure."""
    kind = v.kind.removesuffix("_percent")
    unit = " in % of the stroke" if kind != v.kind else ""
    return f"{v.metric} ({'RMS' if kind == 'rms' else kind}{unit})"


def _cell(r: CaseResult | None, curve: bool) -> str:
    return "<td></td>" if r is None else f"<td>{linked(r, curve)}</td>"


def linked(r: CaseResult, curve: bool = True) -> str:
    """Return the error curve, the metric and the verdict of a case, as a link to the case."""
    v = main_verdict(r)
    number = "" if v is None else f"{escape(figure_of(v.value, v.kind))} "
    error = _curve(r) if curve else ""
    return f'<a class="{"ok" if r.passed else "bad"}" href="#{place(r)}">{error}{number}{word_of(r)}</a>'


def _curve(r: CaseResult) -> str:
    """Return a plot of the error, or "" if there is no error or the error is not finite."""
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
    d = path(x / 10, (HIGH / 2 - (HIGH / 2 - 1) * y) / 10)  # `path` prints tenths, but here whole points are enough
    return f'<svg viewBox="0 0 {WIDE} {HIGH}" aria-hidden="true"><path d="{d}"/></svg>'


def case_table(results: Sequence[CaseResult], curves: bool, shown: Set[str]) -> str:
    """Return the cases of a scenario with all metrics, limits and margins as HTML.

    With `curves`, a cell shows the curve of the error and links to the case. `shown` contains the link targets of the
    cases with their own section. For any other case, the link target is its row.
    """
    metrics = {v.metric: r.system.case.metrics[v.metric] for r in results for v in r.verdicts}
    names = [label(k, unit_of_metric(results[0].system, m)) for k, m in metrics.items()]
    loops = any(r.loop is not None for r in results)
    names += ["Ms in dB", "delay margin in steps"] if loops else []
    heads = ["case", "error" if curves else "verdict", *names]
    head = "".join(f'<th scope="col">{escape(h)}</th>' for h in heads)
    rows = "".join(_row(r, list(metrics), loops, curves, place(r) in shown) for r in results)
    return f'<div class="wide"><table class="matrix metrics"><tr>{head}</tr>{rows}</table></div>'


def _row(r: CaseResult, metrics: Sequence[str], loops: bool, curves: bool, shown: bool) -> str:
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
    """Return value and limit of a metric as HTML. The sign between them shows the verdict."""
    if v is None:
        return "<td></td>"
    good = v.within and not (fails and v.same is False)
    limit = "" if v.limit is None else f" <small>{'≤' if v.within else '&gt;'} {v.limit:.3g}</small>"
    was = "" if v.baseline is None or v.same is not False else escape(figure_of(v.baseline, v.kind))
    changed = f'<small class="was">was {was}</small>' if was else ""
    return f"<td{'' if good else BAD}>{escape(figure_of(v.value, v.kind))}{limit}{changed}</td>"
