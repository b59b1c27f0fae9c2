"""report.html and report.json: one self-contained page without script or external request, and the same for machines.

The page shows verdicts first, then every scenario: its order, step and delays, and for every case the loop before and
after compensation, reference and output, and the error between samples.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hystfmu import __version__
from hystfmu.files import write_text
from hystfmu.plot import Line, Plot
from hystfmu.scenario.delay_budget import delay_budget
from hystfmu.scenario.events import missed
from hystfmu.scenario.system import System
from hystfmu.scenario.trace import Trace

if TYPE_CHECKING:
    from hystfmu.scenario import Result

__all__ = ["Line", "Plot", "Section", "Table", "write_report"]


SCHEMES = {"gauss_seidel": "Gauss-Seidel", "jacobi": "Jacobi", "iterative": "iterative"}
MOST_ROWS = 400  # of the signals of a case in report.json


@dataclass(frozen=True)
class Table:
    """Rows under a heading; cells are text or numbers."""

    head: Sequence[str]
    rows: Sequence[Sequence[object]]
    caption: str = ""


@dataclass(frozen=True)
class Section:
    """A part of the page that is not a scenario, e.g. the identification of the models in it."""

    title: str
    text: str = ""
    tables: Sequence[Table] = field(default_factory=tuple)
    plots: Sequence[Plot] = field(default_factory=tuple)


def write_report(
    results: Sequence[Result],
    directory: str | Path,
    extra_sections: Sequence[Section] = (),
    title: str = "HystFMU report",
) -> Path:
    """Write report.html and report.json.

    Parameters
    ----------
    results : sequence of Result
        As `run_scenarios` returns them.
    directory : path
        Made if it does not exist.
    extra_sections : sequence of Section
        Put before the scenarios.

    Returns
    -------
    Path
        Of report.html.
    """
    directory = Path(directory)
    passed = sum(r.passed for r in results)
    body = [f"<h1>{escape(title)}</h1>"]
    if results:
        good = passed == len(results)
        body.append(
            f'<p class="lead"><b class="{"ok" if good else "bad"}">{passed} of {len(results)} cases passed</b>, '
            f"{sum(r.seconds for r in results):.1f} s of simulation. HystFMU {escape(__version__)}.</p>"
        )
    body += [section(s) for s in extra_sections]
    if results:
        body.append(_overview(results))
    for name in dict.fromkeys(r.scenario for r in results):
        body.append(_scenario([r for r in results if r.scenario == name]))
    write_text(directory / "report.json", json.dumps(_plain(_machine(results, extra_sections))))
    write_text(directory / "report.html", page(title, body))
    return directory / "report.html"


def page(title: str, body: Sequence[str]) -> str:
    """A whole page with the style of all reports."""
    return _PAGE.replace("TITLE", escape(title)).replace("BODY", "\n".join(body))


def _plain(v: Any) -> Any:
    """JSON knows no infinity and no NaN: text instead, as a diverged run may give."""
    if isinstance(v, dict):
        return {str(k): _plain(x) for k, x in v.items()}
    if isinstance(v, list | tuple):
        return [_plain(x) for x in v]
    if isinstance(v, np.generic):
        v = v.item()
    return v if not isinstance(v, float) or np.isfinite(v) else str(v)


def _machine(results: Sequence[Result], sections: Sequence[Section]) -> dict[str, Any]:
    return {
        "version": __version__,
        "passed": all(r.passed for r in results),
        "sections": [{"title": s.title, "text": s.text, "tables": [vars(t) for t in s.tables]} for s in sections],
        "results": [{**r.summary(), "loop": _loop_facts(r.system), **_signals(r)} for r in results],
    }


def _signals(r: Result) -> dict[str, Any]:
    """Some rows of the recorded signals: enough for `hystfmu compare` to draw them."""
    if r.trace is None:
        return {}
    picked = np.unique(np.linspace(0, len(r.trace.t) - 1, MOST_ROWS).round().astype(int))
    table = {"t": r.trace.t[picked]} | {s: r.trace[s][picked] for s in r.system.case.record}
    return {"signals": {name: [float(f"{x:.7g}") for x in v.tolist()] for name, v in table.items()}}


def _loop_facts(system: System) -> dict[str, Any]:
    case = system.case
    return {
        "order": list(case.order),
        "step": case.step,
        "fine_step": system.h,
        "periods": {p.name: system.length(p) for p in system.parts},
        "delays": [vars(d) for d in delay_budget(system)],
        "note": case.delay,
    }


# ---- pieces of the page ---------------------------------------------------------------------------------------------
NUMBER, OPEN = ' class="num"', ' open="open"'


def _number(v: object) -> str:
    return f"{v:.4g}" if isinstance(v, float) else escape(str(v))


def _table(t: Table) -> str:
    head = "".join(f"<th>{escape(h)}</th>" for h in t.head)
    rows = []
    for row in t.rows:
        cells = "".join(
            f"<td{NUMBER if isinstance(c, int | float) and not isinstance(c, bool) else ''}>{_number(c)}</td>"
            for c in row
        )
        rows.append(f"<tr>{cells}</tr>")
    caption = f"<caption>{escape(t.caption)}</caption>" if t.caption else ""
    return f'<div class="wide"><table>{caption}<tr>{head}</tr>{"".join(rows)}</table></div>'


def section(s: Section) -> str:
    """A section as HTML."""
    text = f"<p>{escape(s.text)}</p>" if s.text else ""
    return f"<section><h2>{escape(s.title)}</h2>{text}{''.join(map(_table, s.tables))}{_plots(s.plots)}</section>"


def _plots(plots: Sequence[Plot]) -> str:
    figures = [f"<figure>{p.svg()}<figcaption>{escape(p.title)}</figcaption></figure>" for p in plots]
    return f'<div class="plots">{"".join(figures)}</div>' if figures else ""


def _overview(results: Sequence[Result]) -> str:
    rows = []
    for r in results:
        link = f'<a href="#{escape(r.scenario)}">{escape(r.scenario)}</a>'
        if not r.verdicts:
            rows.append(
                f'<tr><td>{link}</td><td>{escape(r.case)}</td><td colspan="4">{escape("; ".join(r.lines))}</td>'
                '<td class="bad">stopped</td></tr>'
            )
        for v in r.verdicts:
            words = ("ok" if v.within else "over the limit") + (", changed" if v.same is False else "")
            if v.baseline is None:
                words += ", no baseline"
            good = v.within and v.same is not False
            limit = "" if v.limit is None else f"{v.limit:.4g}"
            old = "" if v.baseline is None else f"{v.baseline:.4g}"
            rows.append(
                f"<tr><td>{link}</td><td>{escape(r.case)}</td><td>{escape(v.metric)}</td>"
                f'<td class="num">{v.value:.4g}</td><td class="num">{limit}</td><td class="num">{old}</td>'
                f'<td class="{"ok" if good else "bad"}">{words}</td></tr>'
            )
    head = "".join(f"<th>{h}</th>" for h in ("scenario", "case", "metric", "value", "limit", "baseline", "verdict"))
    failures = "".join(f"<li>{escape(line)}</li>" for r in results for line in r.lines)
    listed = f'<ul class="bad">{failures}</ul>' if failures else ""
    body = f'<div class="wide"><table><tr>{head}</tr>{"".join(rows)}</table></div>'
    return f"<section><h2>Verdicts</h2>{listed}{body}</section>"


def _scenario(results: Sequence[Result]) -> str:
    first = results[0].system
    parts = [f'<section id="{escape(first.case.scenario)}"><h2>{escape(first.case.scenario)}</h2>']
    if first.case.about:
        parts.append(f"<p>{escape(first.case.about)}</p>")
    parts.append(_table(Table(("loop", "unless a case says otherwise"), _loop_rows(first))))
    parts.append(_table(_delays(first)))
    for k, r in enumerate(results):
        state = "ok" if r.passed else "bad"
        text = f" - {escape(r.system.case.text)}" if r.system.case.text else ""
        plots = _plots(_case_plots(r.system, r.trace)) if r.trace is not None else ""
        other = _loop_rows(r.system) != _loop_rows(first)  # a delay case says what it adds
        table = _table(Table(("loop", "of this case"), _loop_rows(r.system))) if other else ""
        parts.append(
            f'<details{OPEN if k == 0 else ""}><summary><b class="{state}">{escape(r.case)}</b>{text}</summary>'
            f"{table}{plots}</details>"
        )
    return "".join([*parts, "</section>"])


def _loop_rows(system: System) -> list[Sequence[object]]:
    case = system.case
    rates = [f"{p.name} every {system.length(p) * 1e3:.6g} ms" for p in system.parts if system.length(p) != case.step]
    rows: list[Sequence[object]] = [
        (f"order ({SCHEMES[case.coupling.scheme]})", " - ".join(case.order)),
        ("step", f"{case.step * 1e3:.6g} ms" + (f"; {', '.join(rates)}" if rates else "")),
    ]
    rows += [
        ("delay", f"{d.where}: {d.steps:g} steps = {d.steps * case.step * 1e3:.4g} ms ({d.text})")
        for d in delay_budget(system)
    ]
    if case.delay:
        rows.append(("note", case.delay))
    return [*rows, *(("note", line) for line in missed(system))]


def _delays(system: System) -> Table:
    """The delays that the same loop has under every coupling, in steps."""
    budgets = []
    for scheme in SCHEMES:
        coupling = system.case.coupling.model_copy(update={"scheme": scheme})
        other = replace(system, case=replace(system.case, coupling=coupling))
        budgets.append({d.where: d.steps for d in delay_budget(other)})
    rows = [[w, *(b.get(w, 0.0) for b in budgets)] for w in dict.fromkeys(w for b in budgets for w in b)]
    return Table(("delay in steps", *SCHEMES.values()), rows)


def _case_plots(system: System, trace: Trace) -> list[Plot]:
    case = system.case
    after = min((m.after for m in case.metrics.values()), default=0.0)
    window = trace.t >= after
    plots = []
    if case.loops:
        lines = [Line(f"{b} over {a}", _centred(trace[a][window]), _centred(trace[b][window])) for a, b in case.loops]
        plots.append(Plot("Loops, each scaled to its range", "input, scaled", "output, scaled", lines))
    if case.record:
        lines = [Line(s, trace.t, trace[s]) for s in case.record]
        plots.append(Plot("Signals", "t in s", "value", lines))
    tracked = next((m for m in case.metrics.values() if m.against is not None and m.kind.endswith("_percent")), None)
    if tracked is not None and tracked.against is not None:
        e = (trace[tracked.signal] - trace[tracked.against])[window]
        stroke = tracked.stroke or float(np.ptp(trace[tracked.against][window]))
        name = f"{tracked.signal} - {tracked.against}"
        line = Line(name, trace.t[window], 100 * e / stroke)
        plots.append(Plot("Error, between samples included", "t in s", "percent of stroke", [line], envelope=True))
    return plots


def _centred(v: np.ndarray[Any, np.dtype[np.float64]]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Scaled to [-1, 1], so that loops of different units share a diagram."""
    lo, hi = float(v.min()), float(v.max())
    return (2 * v - lo - hi) / (hi - lo) if hi > lo else v - lo


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>TITLE</title>
<style>
:root { --bg:#fff; --fg:#1b2733; --soft:#5d6b78; --line:#d9e0e6; --c0:#0b63b5; --c1:#d1521b; --c2:#2a8a4a; --c3:#8a3fa0;
  --ok:#1d7a3c; --bad:#b3261e; color-scheme:light dark }
@media (prefers-color-scheme: dark) { :root { --bg:#12181e; --fg:#e4e9ee; --soft:#9aa8b5; --line:#2c3742; --c0:#62aef2;
  --c1:#ff9a66; --c2:#6fd08c; --c3:#cf96e0; --ok:#6fd08c; --bad:#ff8a80 } }
body { margin:0 auto; max-width:1080px; padding:1rem; background:var(--bg); color:var(--fg);
  font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif }
h1 { font-size:1.6rem; margin:.5rem 0 }
h2 { font-size:1.2rem; margin:2rem 0 .5rem; border-bottom:1px solid var(--line) }
.lead { color:var(--soft) } .ok { color:var(--ok) } .bad { color:var(--bad) } a { color:var(--c0) }
.wide { overflow-x:auto } table { border-collapse:collapse; font-size:.88rem; margin:.5rem 0 }
th,td { text-align:left; padding:.2rem .7rem .2rem 0; border-bottom:1px solid var(--line); vertical-align:top }
th { color:var(--soft); font-weight:600 } .num { text-align:right; font-variant-numeric:tabular-nums }
caption { text-align:left; color:var(--soft); padding:.3rem 0 } details { margin:.4rem 0 } summary { cursor:pointer }
.plots { display:grid; grid-template-columns:repeat(auto-fit,minmax(min(100%,320px),1fr)); gap:1rem }
figure { margin:0 } figcaption { color:var(--soft); font-size:.85rem } svg { width:100%; height:auto; display:block }
.grid { stroke:var(--line); fill:none } .frame { stroke:var(--soft); fill:none }
.tick { fill:var(--soft); font-size:11px }
.line { vector-effect:non-scaling-stroke; fill:none; stroke-width:1.4; stroke-linejoin:round }
.c0 { stroke:var(--c0) } .c1 { stroke:var(--c1) } .c2 { stroke:var(--c2) } .c3 { stroke:var(--c3) }
</style></head><body>
BODY
</body></html>
"""
