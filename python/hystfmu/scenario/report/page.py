"""Write report.html and report.json of scenarios: a self-contained page, and the same results as data.

The page shows the verdicts first.  Every scenario follows with its order, step and delays, and every case with the loop
before and after compensation, reference and output, and the tracking error, including the error between samples.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hystfmu import __version__
from hystfmu.base.files import write_text
from hystfmu.report.page import NUMBER, Section, Table, figures, page, section, table
from hystfmu.scenario.outcome.plots import case_plots
from hystfmu.scenario.system.delay_budget import delay_budget
from hystfmu.scenario.system.events import missed
from hystfmu.scenario.system.system import System

if TYPE_CHECKING:
    from hystfmu.scenario.verdict.result import Result

MOST_ROWS = 400  # rows per signal in report.json
OPEN = ' open="open"'
METHODS = {"newton": "Newton", "relaxation": "Aitken relaxation"}
SCHEMES = {"gauss_seidel": "Gauss-Seidel", "jacobi": "Jacobi", "iterative": "iterative"}


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
        Results of `run_scenarios`.
    directory : path
        Folder to write into; created if it does not exist.
    extra_sections : sequence of Section
        Sections placed before the scenarios.
    title : str
        Title of the page.

    Returns
    -------
    Path
        Path of report.html.
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


def _plain(v: Any) -> Any:
    """Convert to JSON types.  Infinity and NaN, which a diverged run gives, become text."""
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
    """Select rows of the recorded signals, enough for `hystfmu compare` to plot them."""
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


def _overview(results: Sequence[Result]) -> str:
    """List the failures, then one line per scenario that opens to its metrics."""
    failures = "".join(f"<li>{escape(line)}</li>" for r in results for line in r.lines)
    listed = f'<ul class="bad">{failures}</ul>' if failures else ""
    groups: dict[str, list[Result]] = {}
    for r in results:
        groups.setdefault(r.scenario, []).append(r)
    return f"<section><h2>Verdicts</h2>{listed}{''.join(_group(n, g) for n, g in groups.items())}</section>"


def _group(name: str, results: Sequence[Result]) -> str:
    passed = sum(r.passed for r in results)
    good = passed == len(results)
    head = "".join(
        f"<th{kind}>{h}</th>"
        for h, kind in (
            ("case", ""),
            ("metric", ""),
            ("value", NUMBER),
            ("limit", NUMBER),
            ("baseline", NUMBER),
            ("verdict", ""),
            ("Ms dB", NUMBER),
            ("delay margin, steps", NUMBER),
        )
    )
    return (
        f'<details{"" if good else OPEN}><summary><b class="{"ok" if good else "bad"}">{passed} of {len(results)}</b> '
        f'<a href="#{escape(name)}">{escape(name)}</a></summary>'
        f'<div class="wide"><table><tr>{head}</tr>{"".join(map(_verdict_rows, results))}</table></div></details>'
    )


def _verdict_rows(r: Result) -> str:
    if not r.verdicts:
        why = escape("; ".join(r.lines))
        return (
            f'<tr><td>{escape(r.case)}</td><td colspan="4">{why}</td><td class="bad">stopped</td>{_margins(r, 1)}</tr>'
        )
    rows = []
    for k, v in enumerate(r.verdicts):
        words = ("ok" if v.within else "over the limit") + (", changed" if v.same is False else "")
        if v.baseline is None:
            words += ", no baseline"
        good = v.within and v.same is not False
        case = f'<td rowspan="{len(r.verdicts)}">{escape(r.case)}</td>' if k == 0 else ""
        numbers = "".join(f"<td{NUMBER}>{'' if x is None else f'{x:.4g}'}</td>" for x in (v.value, v.limit, v.baseline))
        rows.append(
            f"<tr>{case}<td>{escape(v.metric)} <small>{escape(v.kind)}</small></td>{numbers}"
            f'<td class="{"ok" if good else "bad"}">{words}</td>{_margins(r, len(r.verdicts)) if k == 0 else ""}</tr>'
        )
    return "".join(rows)


def _margins(r: Result, rows: int) -> str:
    """Return the cells with the margins of the loop of a case, empty where it has none."""
    cells = r.loop.cells() if r.loop is not None else ["", ""]
    return "".join(f'<td rowspan="{rows}"{NUMBER}>{c}</td>' for c in cells)


def _scenario(results: Sequence[Result]) -> str:
    first = results[0].system
    parts = [f'<section id="{escape(first.case.scenario)}"><h2>{escape(first.case.scenario)}</h2>']
    if first.case.about:
        parts.append(f"<p>{escape(first.case.about)}</p>")
    parts.append(table(Table(("loop", "unless a case says otherwise"), _loop_rows(first))))
    parts.append(table(_delays(first)))
    for k, r in enumerate(results):
        state = "ok" if r.passed else "bad"
        text = f" - {escape(r.system.case.text)}" if r.system.case.text else ""
        s = r.sweeps
        counted = f"<p>{s['mean']:.3g} sweeps per step, at most {s['most']} ({METHODS[s['method']]})</p>" if s else ""
        plots = figures(case_plots(r.system, r.trace)) if r.trace is not None else ""
        other = _loop_rows(r.system) != _loop_rows(first)  # show the delays that this case adds
        own = table(Table(("loop", "of this case"), _loop_rows(r.system))) if other else ""
        parts.append(
            f'<details{OPEN if k == 0 else ""}><summary><b class="{state}">{escape(r.case)}</b>{text}</summary>'
            f"{own}{counted}{plots}</details>"
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
    """Tabulate the delays of the loop under every coupling scheme, in steps."""
    budgets = []
    for scheme in SCHEMES:
        coupling = system.case.coupling.model_copy(update={"scheme": scheme})
        other = replace(system, case=replace(system.case, coupling=coupling))
        budgets.append({d.where: d.steps for d in delay_budget(other)})
    rows = [[w, *(b.get(w, 0.0) for b in budgets)] for w in dict.fromkeys(w for b in budgets for w in b)]
    return Table(("delay in steps", *SCHEMES.values()), rows)
