"""The results of scenarios as data, the content of report.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hystfmu import __version__
from hystfmu.report.page import Section
from hystfmu.scenario.system.delay_budget import delay_budget
from hystfmu.scenario.system.measures import unit_of
from hystfmu.scenario.system.system import System

if TYPE_CHECKING:
    from hystfmu.scenario.verdict.result import Result

MOST_ROWS = 400  # rows per signal


def machine_form(
    results: Sequence[Result], sections: Sequence[Section], more: Mapping[str, Any] | None = None
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


def _signals(r: Result) -> dict[str, Any]:
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
