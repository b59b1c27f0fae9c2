"""Write report.html and report.json of scenarios. Both files contain the same results, as a page and as data.

The page first shows the worst and the best case, then all cases in a matrix. A section for each scenario follows. It
contains metrics, order, step and delays, and for each case the hysteresis loops, signals and the tracking error,
including the error between samples.

JUnit XML contains the verdicts for continuous integration servers.
"""

import json
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence, Set
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base import __version__, escape, write_bytes, write_text
from hystfmu.fmu.archive import xml_file
from hystfmu.report.page import Section, Table, figures, page, section, table
from hystfmu.scenario.outcome.metrics import unit_of
from hystfmu.scenario.outcome.result import CHANGED, CaseResult, grouped
from hystfmu.scenario.report.cases import case_plots, case_table, matrix, nearness, place, worst_and_best
from hystfmu.scenario.report.loops import delay_budget, delay_table, loop_explorer, loop_rows
from hystfmu.scenario.system.system import System

MOST_ROWS = 400  # largest number of rows per signal


def machine_form(
    results: Sequence[CaseResult], sections: Sequence[Section], more: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Return the results, the tables of further sections, and the entries of `more` as JSON types."""
    form = {
        **(more or {}),
        "version": __version__,
        "passed": all(r.passed for r in results),
        "sections": [
            {"title": s.title, "text": s.text, "tables": [vars(t) for t in (*s.tables, *s.folded)]} for s in sections
        ],
        "results": [{**r.summary(), "loop": _loop_facts(r.system), **_signals(r)} for r in results],
    }
    plain: dict[str, Any] = _plain(form)
    return plain


def _plain(v: Any) -> Any:
    """Return a value as JSON types. Infinity and NaN, which a diverged run contains, are converted to text."""
    if isinstance(v, dict):
        return {str(k): _plain(x) for k, x in v.items()}
    if isinstance(v, list | tuple):
        return [_plain(x) for x in v]
    if isinstance(v, np.generic):
        v = v.item()
    return v if not isinstance(v, float) or np.isfinite(v) else str(v)


def _signals(r: CaseResult) -> dict[str, Any]:
    """Return selected rows of the recorded signals, from which `hystfmu compare` can plot them."""
    if r.trace is None:
        return {}
    picked = np.unique(np.linspace(0, len(r.trace.t) - 1, MOST_ROWS).round().astype(int))
    table = {"t": r.trace.t[picked]} | {s: r.trace[s][picked] for s in r.system.case.record}
    units = {s: unit_of(r.system, s) for s in r.system.case.record}
    return {
        "signals": {name: [float(f"{x:.7g}") for x in v.tolist()] for name, v in table.items()},
        "units": {s: unit for s, unit in units.items() if unit},
    }


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


def write_junit(results: Sequence[CaseResult], path: str | Path) -> None:
    """Write results as JUnit XML: one suite per scenario, one test per case."""
    root = ET.Element("testsuites", _counts(results))
    for name, own in grouped(results, lambda r: r.scenario).items():
        suite = ET.SubElement(root, "testsuite", {"name": name, **_counts(own)})
        for r in own:
            test = ET.SubElement(suite, "testcase", {"classname": name, "name": r.case, "time": f"{r.seconds:.3f}"})
            if r.trace is None:
                ET.SubElement(test, "error", message=r.lines[0]).text = "\n".join(r.lines)
            elif not r.passed:
                ET.SubElement(test, "failure", message=r.lines[0]).text = "\n".join(r.lines)
            ET.SubElement(test, "system-out").text = "\n".join(f"{v.metric} = {v.value!r}" for v in r.verdicts)
    write_bytes(path, xml_file(root))


def _counts(results: Sequence[CaseResult]) -> dict[str, str]:
    errors = sum(r.trace is None for r in results)
    failures = sum(not r.passed for r in results) - errors
    seconds = sum(r.seconds for r in results)
    return {"tests": str(len(results)), "failures": str(failures), "errors": str(errors), "time": f"{seconds:.3f}"}


ALL = "Scenarios against cases, each with its error and verdict"
OPEN = ' open="open"'
METHODS = {"newton": "Newton", "relaxation": "Aitken relaxation"}
# limits in characters: of all cases, of their diagrams, of the rows of a case
MOST_SHOWN, LEAST_DRAWN, PER_CASE = 500_000, 100_000, 550
MOST_FAILURES = 3  # largest number of lines above the first diagram, and of expanded cases


def write_report(
    results: Sequence[CaseResult],
    directory: str | Path,
    extra_sections: Sequence[Section] = (),
    title: str = "",
    lead: str = "",
    more: Mapping[str, Any] | None = None,
) -> Path:
    """Write report.html and report.json, and return the path of report.html.

    The extra sections are in front of the scenarios. `lead` is a sentence below the title that states the result. The
    default title contains the names of the scenarios. `more` contains further entries of report.json.
    """
    directory = Path(directory)
    title = title or _title(results)
    body = [f"<h1>{escape(title)}</h1>"]
    if lead:
        body.append(f'<p class="answer">{escape(lead)}</p>')
    if results:
        body.append(_verdict(results))
    body += [section(s) for s in extra_sections]
    if results:
        figures_first = worst_and_best(results)
        body.append(f"<section><h2>Closed loops</h2>{figures_first}</section>" if extra_sections else figures_first)
        body += _scenarios(results)
    if results and not any(s.explorer for s in extra_sections):
        found = loop_explorer([r.system for r in sorted(results, key=lambda r: not r.passed)])
        body += [section(found)] if found is not None else []
    write_text(directory / "report.json", json.dumps(machine_form(results, extra_sections, more)))
    write_text(directory / "report.html", page(title, body))
    return directory / "report.html"


def _title(results: Sequence[CaseResult]) -> str:
    names = list(dict.fromkeys(r.scenario for r in results))
    return f"Loop{'s' if len(names) > 1 else ''} {', '.join(names)}" if 0 < len(names) <= 3 else "Closed loops"


def _verdict(results: Sequence[CaseResult]) -> str:
    """Return the number of passed cases, and the failures, as HTML."""
    passed = sum(r.passed for r in results)
    good = passed == len(results)
    said = (
        f'<p class="lead"><b class="{"ok" if good else "bad"}">{passed} of {len(results)} cases passed</b>, '
        f"{sum(r.seconds for r in results):.1f} s of simulation. HystFMU {escape(__version__)}.</p>"
    )
    # exceeded limits precede changes
    said_of = sorted((line for r in results for line in r.lines), key=lambda line: CHANGED in line)
    lines = [f"<li>{escape(line)}</li>" for line in said_of]
    if lines:
        said += f'<ul class="bad">{"".join(lines[:MOST_FAILURES])}</ul>'
    if rest := "".join(lines[MOST_FAILURES:]):
        said += f"<details><summary>{len(lines) - MOST_FAILURES} more</summary><ul>{rest}</ul></details>"
    return said


def _scenarios(results: Sequence[CaseResult]) -> list[str]:
    """Return a section for each scenario, after the matrix if there are several scenarios."""
    groups = grouped(results, lambda r: r.scenario)
    several = len(groups) > 1
    parts = (
        [f"<section><h2>All cases</h2><details><summary>{ALL}</summary>{matrix(results)}</details></section>"]
        if several
        else []
    )
    drawings = _drawings(results)
    worst = sorted((r for r in results if not r.passed), key=nearness, reverse=True)[:MOST_FAILURES]
    unfolded = {place(r) for r in worst}
    return parts + [_scenario(group, drawings, unfolded, not several) for group in groups.values()]


def _drawings(results: Sequence[CaseResult]) -> dict[str, str]:
    """Return the diagrams of the cases. The keys are the link targets of the cases.

    If there are too many cases, only the cases nearest to their limits have diagrams.
    """
    first = {r.scenario: r for r in sorted(results, key=nearness)}  # the worst case of each scenario
    ordered = sorted(results, key=lambda r: (first[r.scenario] is r, nearness(r)), reverse=True)
    found: dict[str, str] = {}
    room = max(LEAST_DRAWN, MOST_SHOWN - PER_CASE * len(results))
    for r in ordered:
        drawn = figures(case_plots(r.system, r.trace)) if r.trace is not None and room > 0 else ""
        if drawn:
            room -= len(drawn)
            found[place(r)] = drawn
    return found


def _scenario(results: Sequence[CaseResult], drawings: dict[str, str], unfolded: Set[str], curves: bool) -> str:
    first = results[0].system
    name, passed = escape(first.case.scenario), sum(r.passed for r in results)
    state = "ok" if passed == len(results) else "bad"
    parts = [f'<section id="{name}"><h2>{name}: <span class="{state}">{passed} of {len(results)} passed</span></h2>']
    if first.case.about:
        parts.append(f"<p>{escape(first.case.about)}</p>")
    usual = loop_rows(first)
    cases = {place(r): c for r in results if (c := _case(r, drawings.get(place(r), ""), usual, unfolded))}
    metrics = case_table(results, curves, cases.keys())
    parts.append(metrics if curves else f"<details><summary>Metrics and margins</summary>{metrics}</details>")
    facts = table(Table(("loop", "unless a case says otherwise"), usual)) + table(delay_table(first))
    parts.append(f"<details><summary>Order, step and delays of the loop</summary>{facts}</details>")
    parts += cases.values()
    if any(place(r) not in drawings and r.trace is not None for r in results):
        parts.append(
            f'<p class="lead">Diagrams are shown of the cases nearest to their limits. <code>hystfmu run {name} '
            "--case NAME --report DIR</code> shows those of any other.</p>"
        )
    return "".join([*parts, "</section>"])


def _case(r: CaseResult, drawing: str, usual: Sequence[Sequence[object]], unfolded: Set[str]) -> str:
    """Return the further content of a case, which may be empty: diagrams, delays of this case, and sweeps."""
    s, rows = r.sweeps, loop_rows(r.system)
    counted = f"<p>{s['mean']:.3g} sweeps per step, at most {s['most']} ({METHODS[s['method']]})</p>" if s else ""
    other = table(Table(("loop", "of this case"), [row for row in rows if row not in usual])) if rows != usual else ""
    text = escape(r.system.case.text)
    said = "".join(f'<li class="bad">{escape(line)}</li>' for line in r.lines)
    head = f'<b class="{"ok" if r.passed else "bad"}">{escape(r.case)}</b>' + (f" - {text}" if text else "")
    inside = (f"<ul>{said}</ul>" if said else "") + other + counted + drawing
    if not inside:
        return ""
    fold = OPEN if place(r) in unfolded else ""
    return f'<details{fold}><summary>{head}</summary><div id="{place(r)}">{inside}</div></details>'
