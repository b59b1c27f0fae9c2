"""The plant of a loop: units at its rate in series, their linear dynamics, and the slopes over the inverse before them.

The slopes stand for everything with memory.  Dynamics that the inverse undoes, such as creep, count to it.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.core.library import block_types
from hystfmu.design.delays import StateSpace
from hystfmu.design.linear import linearise
from hystfmu.design.sector import CONTINUOUS, gain_of, slopes_along
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.loop.held import ramp_of
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.system import Link, Part, System

MEMORY = ("operators", "inverses", "networks")  # families of the blocks that the slope stands for
DELAY, LEVELS = "delay", "quantiser"


@dataclass(frozen=True)
class PlantSide:
    """Units at the rate of the plant, in series from the command to the measured output.

    Attributes
    ----------
    links : tuple of Link
        Connection that drives each of them; the first brings the command.
    delay : float
        Steps by which delays among them, or their order, let the command act later.
    """

    links: tuple[Link, ...]
    delay: float

    @property
    def entry(self) -> Link:
        """Connection that brings the command."""
        return self.links[0]

    @property
    def units(self) -> tuple[int, ...]:
        """Places of the units; the last one is tracked."""
        return tuple(n.to for n in self.links)


def plant_side(system: System, plant: int, around: Sequence[int]) -> PlantSide:
    """Find the units at the rate of the plant, and the steps by which they delay the command.

    Raises
    ------
    InputError
        They are not in series.
    """
    case, owner = system.case, {p.name: k for k, p in enumerate(system.parts)}
    within = {plant, *around}
    fine = {k for k in within if system.parts[k].period < case.ripple} | {plant}
    links: list[Link] = []
    k, name = plant, system.parts[plant].name
    while k in fine:
        into = [n for n in system.links if n.to == k and owner[system.maker(n).name] in within]
        if len(into) != 1 or len(links) == len(fine):
            raise InputError(
                f"{case.title}: One connection must close the loop at {name} to have margins. Got {len(into)}."
            )
        links.insert(0, into[0])
        k, name = owner[system.maker(into[0]).name], system.maker(into[0]).name
    if fine - {n.to for n in links}:
        raise InputError(f"{case.title}: The units at the rate of the plant must be in series. Got others.")
    late = sum(n.dims["n"] for to in links for n in system.parts[to.to].own.nodes if n.type == DELAY)
    # a value that is read before it is made anew is a fine step old; one such place closes the loop
    readers = [n for n in system.links if system.maker(n) is system.parts[plant] and n.to in within - fine]
    held = sum(not system.fresh(n) for n in links) + any(not system.fresh(n) for n in readers) - 1
    return PlantSide(tuple(links), (late + max(held, 0)) / case.ripple if case.ripple > 1 else float(late))


def has_memory(graph: Graph) -> bool:
    """Whether a unit is an inverse or a model of a hysteresis, for which the slope stands."""
    return any(n.block.family in MEMORY and n.block.rate != CONTINUOUS for n in graph.nodes)


def as_gain(part: Part) -> Graph:
    """Replace the inverse of a hysteresis by a gain of 1 from its first input to its first output."""
    n = len(part.inputs)
    gain = Node("gain", "sum", {"n": n}, {"k": [1.0] + [0.0] * (n - 1)})
    nothing = Node("nothing", "scaling", {"n": 1}, {"gain": 0.0})
    ends = ["gain.u"] if n == 1 else [f"gain.u[{i + 1}]" for i in range(n)]
    outputs = [Output(name, "nothing.y" if i else "gain.y") for i, name in enumerate(part.outputs)]
    inputs = [Input(name, (end,)) for name, end in zip(part.inputs, ends, strict=True)]
    return Graph([gain, nothing], [("gain.y", "nothing.u")], inputs, outputs, sort=False)


def without_levels(graph: Graph) -> Graph:
    """Replace quantisers by gains of 1, which they are for signals of many levels."""
    for n in graph.nodes:
        if n.type == LEVELS:
            graph = graph.replace(Node(n.name, "scaling", {"n": 1}))
    return graph


def dynamics(system: System, side: PlantSide, between: Collection[int]) -> tuple[StateSpace, float]:
    """Return the linear dynamics of the plant side, and the time in which a new command reaches them (s).

    Their static gain is 1 if they have one; without any they are a gain of 1.  Dynamics that ramp up to their input
    take a step of their unit for it.

    Raises
    ------
    InputError
        They are not in series.
    """
    undone = _undone(system, between)
    ways = [(system.parts[link.to], _on_the_way(system, link, side, undone)) for link in side.links]
    chain = [n for _, way in ways for n in way]
    first = next((part for part, way in ways if way), None)
    ramp = ramp_of(chain, system.case.step * first.period / system.case.ripple / first.substeps) if first else 0.0
    gain = Node("gain", "scaling", {"n": 1}, {"gain": 1 / float(np.prod([gain_of(n) for n in chain]))})
    nodes = [gain, *(Node(f"part{i}", n.type, n.dims, n.values) for i, n in enumerate(chain))]
    wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(nodes)]
    ends = [Input("u", ("gain.u",))], [Output("y", f"{nodes[-1].name}.y")]
    return linearise(Graph(nodes, wires, *ends)), ramp


def command_of(system: System, side: PlantSide, between: Sequence[int]) -> Link:
    """Return the connection that brings the command: into the first inverse, or without one into the plant side."""
    return next((n for n in system.links if between and n.to == between[0] and n.input == 0), side.entry)


def slopes_of(system: System, side: PlantSide, between: Sequence[int]) -> tuple[float, float]:
    """Run the case and return the sector of slopes of plant over inverse along its path.

    Raises
    ------
    InputError
        The case stops.
    """
    first = command_of(system, side, between)
    column = next(name for name, place in system.columns.items() if place == first.source)
    try:
        v = Native(system, [column]).run()[column][:: system.case.ripple]
    except Stopped as e:
        raise InputError(f"{system.case.title}: The case must run to its end to have a sector of slopes. {e}") from None
    undone = _undone(system, between)
    inverses = [_driven(system.parts[k], 0, 0) for k in between]
    driven = [_driven(system.parts[n.to], n.input, _output(system, n, side)) for n in side.links]
    return slopes_along(v, *inverses, *(_at_rest(g, undone) for g in driven), h=system.case.step)


def _undone(system: System, between: Collection[int]) -> set[str]:
    """Return the types of the dynamics that inverses before the plant undo.

    A block inverts them, or they lie in the ring of a block whose output is found by trial.
    """
    found: set[str] = set()
    for k in between:
        graph = system.parts[k].own
        edges = [(a.partition(".")[0], b.partition(".")[0]) for a, b in graph.wires]
        found |= {n.block.inverts for n in graph.nodes if n.block.inverts}
        for tried in (n.name for n in graph.nodes if n.block.trial):
            ring = _reached(edges, {tried}) & _reached([(b, a) for a, b in edges], {tried})
            found |= {n.type for n in graph.nodes if n.name in ring}
    return {t for t in found if block_types()[t].rate == CONTINUOUS}


def _output(system: System, link: Link, side: PlantSide) -> int:
    """Return which output of a unit of the plant side goes on."""
    unit = system.parts[link.to]
    after = next((n.source for n in side.links if n.to != link.to and system.maker(n) is unit), None)
    if after is None:
        tracked = next(m.signal for m in system.case.metrics.values() if m.against is not None)
        after = system.columns[tracked]
    return after - unit.first


def _on_the_way(system: System, link: Link, side: PlantSide, undone: Collection[str]) -> list[Node]:
    """Return the dynamics of a unit between its driven input and the output that goes on, which must be in series.

    Those that the inverse undoes do not count.
    """
    graph = _driven(system.parts[link.to], link.input, _output(system, link, side))
    ends = {end.partition(".")[0] for end in graph.inputs[0].to}
    edges = [(a.partition(".")[0], b.partition(".")[0]) for a, b in graph.wires]
    after = _reached(edges, ends)
    before = _reached([(b, a) for a, b in edges], {graph.outputs[0].source.partition(".")[0]})
    found = [n for n in graph.nodes if n.block.rate == CONTINUOUS and n.name in after & before]
    found = [n for n in found if n.type not in undone]
    end = graph.outputs[0].source.partition(".")[0]
    if any(end in _reached([e for e in edges if n.name not in e], ends - {n.name}) for n in found):
        raise InputError(f"{system.case.title}: The dynamics of the plant must be in series. Got some in parallel.")
    return found


def _reached(edges: Sequence[tuple[str, str]], first: set[str]) -> set[str]:
    found = set(first)
    while more := {b for a, b in edges if a in found} - found:
        found |= more
    return found


def _at_rest(graph: Graph, undone: Collection[str]) -> Graph:
    """Replace dynamics by their static gains, but not those that the inverse undoes; leave out delays and levels."""
    for n in graph.nodes:
        if n.type in (DELAY, LEVELS):
            graph = graph.replace(Node(n.name, "scaling", {"n": 1}))
        elif n.block.rate == CONTINUOUS and n.type not in undone:
            graph = graph.replace(Node(n.name, "scaling", {"n": 1}, {"gain": gain_of(n)}))
    return graph


def _driven(part: Part, port: int, output: int) -> Graph:
    """Return the graph of a unit with one of its inputs and one of its outputs first; the others are constant."""
    inputs = [replace(i, start=part.constants.get(i.name, i.start)) for i in part.own.inputs]
    inputs.sort(key=lambda i: i.name != part.inputs[port])
    outputs = sorted(part.own.outputs, key=lambda o: o.name != part.outputs[output])
    return Graph(part.own.nodes, part.own.wires, inputs, outputs, sort=False, step=part.own.step)
