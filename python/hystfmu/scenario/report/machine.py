"""Results of scenarios as data: the content of report.json, and JUnit XML for continuous integration servers."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base import __version__
from hystfmu.base.files import write_bytes
from hystfmu.fmu.archive import xml_file
from hystfmu.report.page import Section
from hystfmu.scenario.outcome.result import CaseResult
from hystfmu.scenario.report.loops import delay_budget
from hystfmu.scenario.system.measures import unit_of
from hystfmu.scenario.system.system import System

MOST_ROWS = 400  # rows per signal


def machine_form(
    results: Sequence[CaseResult], sections: Sequence[Section], more: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Return results, the tables of further sections, and `more` as JSON types."""
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
    """Convert to JSON types. Infinity and NaN, from a diverged run, become text."""
    if isinstance(v, dict):
        return {str(k): _plain(x) for k, x in v.items()}
    if isinstance(v, list | tuple):
        return [_plain(x) for x in v]
    if isinstance(v, np.generic):
        v = v.item()
    return v if not isinstance(v, float) or np.isfinite(v) else str(v)


def _signals(r: CaseResult) -> dict[str, Any]:
    """Select rows of the recorded signals, enough for `hystfmu compare` to plot them."""
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
    for name in dict.fromkeys(r.scenario for r in results):
        own = [r for r in results if r.scenario == name]
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
    return {
        "tests": str(len(results)),
        "failures": str(failures),
        "errors": str(errors),
        "time": f"{seconds:.3f}",
    }
