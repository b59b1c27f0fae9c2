"""Units of a system as one graph: neighbours that can step as one block, or the whole closed loop."""

from __future__ import annotations

from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Input, Node, Output, Port
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import Part, System


def fuse(system: System, parts: tuple[int, ...], own: bool = False) -> tuple[Graph, list[tuple[int, int]]]:
    """Join units with the same period to one graph. The order of the units is kept.

    If `own` is True, values that a unit reads from itself stay external inputs, as in a coupling. The names are
    `unit_block` for blocks, `unit_output` for outputs and `unit_input` for inputs. Also return the inputs of units that
    become inputs of the graph, in the order of the graph. These are inputs with an external source and constants; a
    constant is the start value of its input.
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
    """Return the text of an output. The text of its block is not used, because it does not describe the unit."""
    own = next(o.text for o in part.own.outputs if o.name == port.name)
    return own or f"{part.outputs[i]} of {part.name}" + (f", in {port.unit}" if port.unit else "")


def segments(system: System, cut: bool) -> list[tuple[int, ...]]:
    """Return groups of neighbours with the same period. Each group can be one graph without a change of any value.

    If steps are divided (`cut`), units that accept any step and all other units are in different groups. If a unit
    precedes its source in the order, it reads a value of the previous step. With direct feed-through, unit and source
    in one graph would be an algebraic loop. Therefore such a unit and its source are in different groups.
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
    """Return the closed loop `system` as one graph, for one FMU of the whole loop.

    Raises
    ------
    InputError
        The units have different periods, or a unit has substeps or a first-order hold.
    """
    if len({p.period for p in system.parts}) > 1 or system.h != system.length(system.parts[0]):
        rates = {p.name: p.period for p in system.parts}
        raise InputError(f"{system.case.title}: units of different rates do not fit into one graph: {rates}")
    for p in system.parts:
        if (p.substeps, p.hold) != (1, "zero"):
            raise InputError(f"{system.case.title}: {p.name} has substeps or hold = 'first': one graph has one step")
    return fuse(system, tuple(range(len(system.parts))))[0]


def _scalars(graph: Graph) -> list[tuple[str, str, Port]]:
    """Return (name, endpoint inside the graph, port) for every scalar output."""
    found = []
    for o in graph.outputs:
        port = graph.port(o.name)
        for i, name in enumerate(port.scalar_names):
            end = o.source if port.size == 1 else f"{o.source}[{i + 1}]"
            found.append((name, end, port))
    return found


def _input_ends(graph: Graph) -> list[list[str]]:
    """Return the endpoints inside the graph for every scalar input."""
    ends = []
    for i in graph.inputs:
        size = graph.port(i.name).size
        ends += [[e if size == 1 else f"{e}[{k + 1}]" for e in i.to] for k in range(size)]
    return ends
