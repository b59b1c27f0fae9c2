"""Units of a system as one graph: neighbours that can step as one block, or the whole closed loop."""

from __future__ import annotations

from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Input, Node, Output, Port
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import Part, System


def fuse(system: System, parts: tuple[int, ...], own: bool = False) -> tuple[Graph, list[tuple[int, int]]]:
    """Some units with the same period as one graph, in their order; `own`: values that a unit reads from itself remain
    inputs from outside, as in a coupling.

    Blocks are called `unit_block`, outputs `unit_output`, inputs `unit_input`. Return also the inputs of units that
    became inputs of the graph, in its order: those with a source outside, and constants (with the value as start
    value).
    """
    nodes: list[Node] = []
    wires: list[tuple[str, str]] = []
    inputs: list[Input] = []
    outputs: list[Output] = []
    outside: list[tuple[int, int]] = []
    owner = system.owners
    source = {(link.to, link.input): link.source for link in system.links}
    for k in parts:
        part = system.parts[k]
        g, name = part.own, part.name
        nodes += [Node(f"{name}_{n.name}", n.type, n.dims, n.values) for n in g.nodes]
        wires += [(f"{name}_{a}", f"{name}_{b}") for a, b in g.wires]
        for i, (_, end, port) in enumerate(_scalars(g)):
            outputs.append(Output(f"{name}_{part.outputs[i]}", f"{name}_{end}", port.unit, _text(part, i, port)))
        for i, ends in enumerate(_input_ends(g)):
            ends = [f"{name}_{e}" for e in ends]
            at = source.get((k, i))
            if at is not None and owner[at] in parts and not (own and owner[at] == k):
                other = system.parts[owner[at]]
                end = _scalars(other.own)[at - other.first][1]
                wires += [(f"{other.name}_{end}", e) for e in ends]
            else:
                start = part.constants.get(part.inputs[i], 0.0)
                inputs.append(Input(f"{name}_{part.inputs[i]}", tuple(ends), start=start))
                outside.append((k, i))
    return Graph(nodes, wires, inputs, outputs, sort=False), outside


def _text(part: Part, i: int, port: Port) -> str:
    """Describe an output by its own text; the text of its block does not describe the unit."""
    own = next(o.text for o in part.own.outputs if o.name == port.name)
    return own or f"{part.outputs[i]} of {part.name}" + (f", in {port.unit}" if port.unit else "")


def segments(system: System, cut: bool) -> list[tuple[int, ...]]:
    """Neighbours in the order that have the same period: each can be one graph without changing any value.

    If steps are divided (`cut`), units that accept any step and units that do not are in different groups. A unit with
    direct feed-through of a value of the last step (it precedes its source) would be an algebraic loop within one
    graph: it and its source are in different groups.
    """
    owner = system.owners
    early = [(n.to, owner[n.source], n.input) for n in system.links if owner[n.source] >= n.to]
    held = [(to, source) for to, source, i in early if system.feeds_through(system.parts[to], i)]
    groups: list[list[int]] = []
    for k, part in enumerate(system.parts):
        last = system.parts[groups[-1][-1]] if groups else part
        fits = groups and last.period == part.period and not isinstance(part.graph, Foreign)
        fits = fits and not isinstance(last.graph, Foreign) and not (cut and last.any_step != part.any_step)
        fits = fits and {(p.substeps, p.hold) for p in (part, last)} == {(1, "zero")}
        if fits and not any(source == k and to in groups[-1] for to, source in held):
            groups[-1].append(k)
        else:
            groups.append([k])
    return [tuple(g) for g in groups]


def to_graph(system: System) -> Graph:
    """The closed loop `system` as one graph, one FMU of the whole loop.

    Raises
    ------
    InputError
        Units differ in their periods, or one has substeps or a first-order hold.
    """
    if len({p.period for p in system.parts}) > 1 or system.h != system.length(system.parts[0]):
        rates = {p.name: p.period for p in system.parts}
        raise InputError(f"{system.case.title}: units of different rates do not fit into one graph: {rates}")
    for p in system.parts:
        if (p.substeps, p.hold) != (1, "zero"):
            raise InputError(f"{system.case.title}: {p.name} has substeps or hold = 'first': one graph has one step")
    return fuse(system, tuple(range(len(system.parts))))[0]


def _scalars(graph: Graph) -> list[tuple[str, str, Port]]:
    """(name, endpoint inside the graph, port) for every scalar output."""
    found = []
    for o in graph.outputs:
        port = graph.port(o.name)
        for i, name in enumerate(port.scalar_names):
            end = o.source if port.size == 1 else f"{o.source}[{i + 1}]"
            found.append((name, end, port))
    return found


def _input_ends(graph: Graph) -> list[list[str]]:
    """The endpoints inside the graph for every scalar input."""
    ends = []
    for i in graph.inputs:
        size = graph.port(i.name).size
        ends += [[e if size == 1 else f"{e}[{k + 1}]" for e in i.to] for k in range(size)]
    return ends
