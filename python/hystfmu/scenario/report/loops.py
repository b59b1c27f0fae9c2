"""A loop on a report page: tables of order, step and delays, and an explorer of its hysteretic units.

The delay budget lists every hold and every delayed value. It is computed from order, connections and rates.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hystfmu.base import InputError
from hystfmu.graph import Graph
from hystfmu.graph.graph import is_hysteretic
from hystfmu.model.explored import explored_graph
from hystfmu.report.explorer import Explored, Explorer
from hystfmu.report.page import Section, Table
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.outcome.metrics import label, unit_of
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.events import missed
from hystfmu.scenario.system.system import Link, Part, System


@dataclass(frozen=True)
class Delay:
    """Delay of a signal in base steps (`steps`). `where` is the connection or the unit of this delay."""

    where: str
    steps: float
    text: str


def delay_budget(system: System) -> list[Delay]:
    """Return every delay in the system: held values, values of the previous step, and delay blocks.

    A connection to an earlier unit in the order transmits the value of the previous step. With Jacobi coupling, every
    connection does so. With iterative coupling, no connection does. In a unit with direct feed-through, this value is
    one step late. In a unit without direct feed-through, such as a plant with dynamics, the value is a command that is
    held during the step, and the delay is half a step on average. A first-order hold compensates both delays to first
    order, so they count as 0.
    """
    owner, names, ripple = system.owners, system.names, system.case.ripple
    found: list[Delay] = []
    for link in system.links:
        to, k = system.parts[link.to], owner[link.source]
        source = system.parts[k]
        if system.fresh(link):
            continue
        where = f"{names[link.source]} -> {to.name}.{to.inputs[link.input]}"
        held = source.period / ripple
        if to.hold == "first":
            found.append(Delay(where, 0.0, "one step late, made up for by a straight line through the last two values"))
        elif system.feeds_through(to, link.input):
            why = "all units read first" if k < link.to else "the reader stands earlier in the order"
            found.append(Delay(where, held, f"one step of its source late: {why}"))
        else:
            found.append(Delay(where, held / 2, "held between samples: half a step on average"))
    for part in system.parts:
        for node in part.graph.nodes:
            if node.type == "delay":
                steps = node.dims["n"] * part.period / ripple
                found.append(Delay(part.name, steps, f"delay block of {node.dims['n']} steps of the unit"))
    return found


SCHEMES = {"gauss_seidel": "Gauss-Seidel", "jacobi": "Jacobi", "iterative": "iterative"}


def loop_rows(system: System) -> list[Sequence[object]]:
    """Return order, step, delays and notes of a loop as rows of a table."""
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
    """Return a table of the delays of the loop (steps) for every coupling scheme."""
    budgets = []
    for scheme in SCHEMES:
        coupling = system.case.coupling.model_copy(update={"scheme": scheme})
        other = replace(system, case=replace(system.case, coupling=coupling))
        budgets.append({d.where: d.steps for d in delay_budget(other)})
    rows = [[w, *(b.get(w, 0.0) for b in budgets)] for w in dict.fromkeys(w for b in budgets for w in b)]
    return Table(("delay in steps", *SCHEMES.values()), rows)


TEXT = (
    "The hysteretic units of the loops run in this page, over the range that their input has in the loop: a unit "
    "alone, or behind the inverse of its loop. Grey: one rise and fall of the input."
)
MOST_MODELS = 4
MOST_ROWS = 100_000  # largest number of rows in the simulation that determines the range of an input
DIVERGED = 1e9  # larger than any input of a stable loop, in any unit of measure


def loop_explorer(systems: Sequence[System]) -> Section | None:
    """Return an explorer of the hysteretic units of these systems. All have the units of measure of the first one.

    The result is None if there are no such units. A unit that differs from another unit only in values of parameters is
    omitted, because the reader of the page can change these values.
    """
    models: dict[str, Explored] = {}
    ports: tuple[str, str] | None = None
    seen: set[str] = set()
    for system in systems:
        for part in _plants(system):
            own = tuple(unit_of(system, f"{part.name}.{names[0]}") for names in (part.inputs, part.outputs))
            form = f"{own} {[(n.name, n.type, n.dims) for n in part.own.nodes]} {part.own.wires}"
            if form in seen or own != (ports or own) or len(models) == MOST_MODELS:
                continue
            span = _range(system, part)
            if span is None:
                continue
            seen.add(form)
            ports = own[0], own[1]
            name = part.name if part.name not in models else f"{part.name} of {system.case.title}"
            models[name] = explored_graph(part.own, name, _inverse(system, part), system.case.step, span)
    if ports is None:
        return None
    shown = Explorer([*models.values()], label("input", ports[0]), label("output", ports[1]))
    return Section("Explorer", TEXT, explorer=shown)


def _hysteretic(system: System) -> Iterator[Part]:
    for part in system.parts:
        graph = part.graph
        if isinstance(graph, Graph) and is_hysteretic(graph) and part.inputs and part.outputs:
            yield part


def _plants(system: System) -> list[Part]:
    """Return the hysteretic units that drive no other hysteretic unit; empty for a system with foreign FMUs."""
    if system.foreign:
        return []
    inverses = [_before(system, part) for part in _hysteretic(system)]
    return [part for part in _hysteretic(system) if part not in inverses]


def _before(system: System, part: Part) -> Part | None:
    """Return the hysteretic unit that drives `part`, directly or through units with one input (delay, converter)."""
    hysteretic, passed = list(_hysteretic(system)), [part]
    while (link := _link(system, passed[-1])) is not None:
        maker = system.maker(link)
        if maker in passed:
            return None
        if maker in hysteretic:
            return maker
        if len(maker.inputs) != 1:
            return None
        passed.append(maker)
    return None


def _link(system: System, part: Part) -> Link | None:
    """Return the connection to the first input of a unit."""
    index = system.parts.index(part)
    return next((k for k in system.links if (k.to, k.input) == (index, 0)), None)


def _inverse(system: System, part: Part) -> Graph | None:
    """Return the graph of the inverse in front of `part`.

    Return None if there is no inverse whose only input is the wanted output.
    """
    found = _before(system, part)
    return found.own if found is not None and len(found.inputs) == 1 else None


def _range(system: System, part: Part) -> tuple[float, float] | None:
    """Return the range of the first input of `part` in a run, or None if it is constant or diverges."""
    link = _link(system, part)
    if link is None:
        return None
    source = system.names[link.source]
    lo, hi = np.inf, -np.inf
    try:
        for chunk in Native(system, [source]).chunks():
            lo, hi = min(lo, float(chunk.values.min())), max(hi, float(chunk.values.max()))
            if chunk.first > MOST_ROWS:
                break
    except (Stopped, InputError):  # a failed simulation for the range must not prevent the report
        return None
    return (lo, hi) if lo < hi and max(-lo, hi) < DIVERGED else None
