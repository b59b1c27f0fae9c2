"""Order, step and delays of a loop as tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from hystfmu.report.page import Table
from hystfmu.scenario.system.delay_budget import delay_budget
from hystfmu.scenario.system.events import missed
from hystfmu.scenario.system.system import System

SCHEMES = {"gauss_seidel": "Gauss-Seidel", "jacobi": "Jacobi", "iterative": "iterative"}


def loop_rows(system: System) -> list[Sequence[object]]:
    """Return order, step, delays and notes of a loop as rows."""
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


def delay_table(system: System) -> Table:
    """Tabulate the delays of the loop under every coupling scheme, in steps."""
    budgets = []
    for scheme in SCHEMES:
        coupling = system.case.coupling.model_copy(update={"scheme": scheme})
        other = replace(system, case=replace(system.case, coupling=coupling))
        budgets.append({d.where: d.steps for d in delay_budget(other)})
    rows = [[w, *(b.get(w, 0.0) for b in budgets)] for w in dict.fromkeys(w for b in budgets for w in b)]
    return Table(("delay in steps", *SCHEMES.values()), rows)
