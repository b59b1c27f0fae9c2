"""Section of a page in which the reader moves the input of the hysteretic units of loops: alone, or behind the
inverse."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.graph import Graph
from hystfmu.graph.rate_classes import is_hysteretic
from hystfmu.model.explored import explored_graph
from hystfmu.report.explorer import Explored, Explorer, packed_core
from hystfmu.report.page import Section
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.measures import label, unit_of
from hystfmu.scenario.system.system import Link, Part, System

TEXT = (
    "The hysteretic units of the loops run in this page, over the range that their input has in the loop: a unit "
    "alone, or behind the inverse of its loop. Grey: one rise and fall of the input."
)
MOST_MODELS = 4
MOST_ROWS = 100_000  # of a run that gives the range of an input
DIVERGED = 1e9  # no input of a stable loop, in any unit of measure


def loop_explorer(systems: Sequence[System]) -> Section | None:
    """Return the part of a page for the hysteretic units of systems with equal units of measure at their ports.

    None without such units, or without the core for pages. A unit that differs from another only in values is omitted,
    because the reader can change the values.
    """
    models: dict[str, Explored] = {}
    ports: tuple[str, str] | None = None
    seen: set[str] = set()
    for system in systems if packed_core() is not None else ():
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
    """Return the hysteretic units of a system that drive no other hysteretic unit; none if it has foreign FMUs."""
    if system.foreign:
        return []
    inverses = [_before(system, part) for part in _hysteretic(system)]
    return [part for part in _hysteretic(system) if part not in inverses]


def _before(system: System, part: Part) -> Part | None:
    """Return the hysteretic unit that drives `part`, by itself or through units of one input: delay, converter."""
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
    """Return the graph of the inverse in front of `part`; None if there is none with only the wanted output as
    input."""
    found = _before(system, part)
    return found.own if found is not None and len(found.inputs) == 1 else None


def _range(system: System, part: Part) -> tuple[float, float] | None:
    """Return the range of the first input of `part` in a run; None if it does not move, or the loop is unstable."""
    link = _link(system, part)
    if link is None:
        return None
    source = next(name for name, place in system.columns.items() if place == link.source)
    lo, hi = np.inf, -np.inf
    try:
        for chunk in Native(system, [source]).chunks():
            lo, hi = min(lo, float(chunk.values.min())), max(hi, float(chunk.values.max()))
            if chunk.first > MOST_ROWS:
                break
    except (Stopped, InputError):  # the report of a study that ran does not end for it
        return None
    return (lo, hi) if lo < hi and max(-lo, hi) < DIVERGED else None
