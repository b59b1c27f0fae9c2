"""A case made ready to run: a graph per unit, connections as indices, the grid of times; also the whole as one graph.

The grid is the fine step h/ripple.  A unit has a period in fine steps: 1 (fine), ripple (the normal one), or
ripple * every (slow).  At fine step n every unit whose period divides n runs over its period that ends there, in the
stated order, with the newest values of its sources (Gauss-Seidel).  Engines differ in
what executes a unit, not in this.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from hystfmu.core import Array
from hystfmu.errors import InputError
from hystfmu.graph import Graph, Input, Node, Output, Port, Value
from hystfmu.model import Model
from hystfmu.scenario.foreign import Foreign
from hystfmu.scenario.spec import Case, UnitSpec, inside, split_end

MOST_VALUES = 50_000_000  # doubles recorded in one case


@dataclass(frozen=True)
class Part:
    """One unit of a system."""

    name: str
    graph: Graph | Foreign
    runs_as: Literal["fmu2", "fmu3", "python"]
    period: int
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    constants: dict[str, float]
    first: int
    """Place of its first output among all values of the system."""

    @property
    def own(self) -> Graph:
        """The graph of a unit that is ours.

        Raises
        ------
        InputError
            It is an FMU of somebody else.
        """
        if isinstance(self.graph, Foreign):
            raise InputError(f"{self.name}: {self.graph.path} is an FMU: it cannot become a part of a graph")
        return self.graph


@dataclass(frozen=True)
class Link:
    """A connection: input `input` of part `to` reads value `source` of the system."""

    to: int
    input: int
    source: int


@dataclass(frozen=True)
class System:
    """A case with its graphs.  Its `values` are the outputs of all units, side by side, in the stated order."""

    case: Case
    parts: tuple[Part, ...]
    links: tuple[Link, ...]
    n_values: int
    columns: dict[str, int] = field(default_factory=dict)
    overridden: frozenset[str] = frozenset()
    """Which of the case's overrides found their parameter."""

    @property
    def h(self) -> float:
        """The fine step (s)."""
        return self.case.step / self.case.ripple if self.case.ripple > 1 else self.case.step

    @property
    def n_steps(self) -> int:
        """Number of fine steps."""
        return round(self.case.stop / self.case.step) * self.case.ripple

    def time(self, n: int) -> float:
        """Time at fine step n: a whole number of steps, then fine steps, so that samples do not drift."""
        whole, rest = divmod(n, self.case.ripple)
        return whole * self.case.step + rest * self.h

    def times(self) -> Array:
        """All times, shape (n_steps + 1,), with the bits of `time`."""
        whole, rest = np.divmod(np.arange(self.n_steps + 1), self.case.ripple)
        return np.asarray(whole * self.case.step + rest * self.h)

    def length(self, part: Part) -> float:
        """The step of a unit (s)."""
        return self.h if part.period < self.case.ripple else self.case.step * (part.period // self.case.ripple)

    def column(self, end: str, where: str) -> int:
        """Place of the output `unit.output` among the values."""
        if end not in self.columns:
            unit, _ = split_end(end, where)
            have = [c for c in self.columns if c.startswith(f"{unit}.")] or [p.name for p in self.parts]
            raise InputError(f"{where}: no output {end!r}; there are {', '.join(have)}")
        return self.columns[end]

    def early(self) -> Array:
        """Places of the values that a unit reads before the unit that makes them has stepped (in the stated order)."""
        owner = {p.first + i: k for k, p in enumerate(self.parts) for i in range(len(p.outputs))}
        return np.array(sorted({n.source for n in self.links if owner[n.source] >= n.to}), dtype=np.int64)

    @property
    def foreign(self) -> tuple[Part, ...]:
        """Units that are FMUs of others."""
        return tuple(p for p in self.parts if isinstance(p.graph, Foreign))

    def starts(self) -> Array:
        """Values before the units are initialised: the start values of their outputs, shape (n_values,)."""
        return np.array([s for p in self.parts for s in _starts(p.graph, "output")], dtype=np.float64)


def build(case: Case) -> System:
    """Load the units of a case and connect them.

    Raises
    ------
    InputError
        Unknown block, port or parameter, value out of range, an input without a source, a path that leads out.
    """
    parts: list[Part] = []
    columns: dict[str, int] = {}
    overridden: set[str] = set()
    for name in case.order:
        spec = case.units[name]
        where = f"{case.file}: case {case.name}: units.{name}"
        try:
            graph = _source(case, spec, where)
            graph = _with_values(graph, spec.set)
            for key, value in case.overrides.items():
                unit, parameter = split_end(key, "--set")
                if unit == name and parameter in _parameter_names(graph):
                    graph = _with_values(graph, {parameter: value})
                    overridden.add(key)
        except InputError as e:
            message = str(e)
            raise InputError(message if message.startswith(str(case.file)) else f"{where}: {message}") from None
        inputs, outputs = _names(graph, "input"), _names(graph, "output")
        for key in spec.inputs:
            if key not in inputs:
                raise InputError(f"{where}.inputs: no input {key!r}; there are {list(inputs)}")
        period = 1 if spec.fine else case.ripple * spec.every
        first = len(columns)
        columns.update({f"{name}.{o}": first + i for i, o in enumerate(outputs)})
        constants = {k: float(v) for k, v in spec.inputs.items()}
        runs_as = spec.runs_as
        if isinstance(graph, Foreign):  # an input that nobody drives keeps its start value
            driven = {split_end(to, where)[1] for to in case.connections if to.startswith(f"{name}.")}
            starts = zip(inputs, _starts(graph, "input"), strict=True)
            constants = {k: v for k, v in starts if k not in driven} | constants
            runs_as = "fmu2" if graph.fmi == 2 else "fmu3"
        parts.append(Part(name, graph, runs_as, period, inputs, outputs, constants, first))
    links = _links(case, parts, columns)
    system = System(case, tuple(parts), links, len(columns), columns, frozenset(overridden))
    if (system.n_steps + 1) * len(columns) > MOST_VALUES:
        raise InputError(f"{case.file}: case {case.name}: stop: more than {MOST_VALUES} values would be recorded")
    where = f"{case.file}: case {case.name}"
    for key, ends in signals(case):
        for end in ends:
            system.column(end, f"{where}: {key}")
    return system


def signals(case: Case) -> Iterator[tuple[str, tuple[str, ...]]]:
    """The outputs that a case is about, by the key that names them."""
    yield "record", case.record
    for pair in case.loops:
        yield "loops", pair
    for name, m in case.metrics.items():
        yield f"metrics.{name}", (m.signal,) if m.against is None else (m.signal, m.against)


def _links(case: Case, parts: list[Part], columns: dict[str, int]) -> tuple[Link, ...]:
    where = f"{case.file}: case {case.name}: connections"
    index = {p.name: i for i, p in enumerate(parts)}
    links: list[Link] = []
    for to, source in case.connections.items():
        unit, port = split_end(to, where)
        if unit not in index:
            raise InputError(f"{where}: no unit {unit!r}; there are {list(index)}")
        part = parts[index[unit]]
        if port not in part.inputs:
            raise InputError(f"{where}: no input {to!r}; {unit} has {list(part.inputs)}")
        if port in part.constants:
            raise InputError(f"{where}: {to!r} is connected and has a constant value as well")
        if source not in columns:
            from_unit, _ = split_end(source, where)
            have = [c for c in columns if c.startswith(f"{from_unit}.")] or list(index)
            raise InputError(f"{where}: no output {source!r} for {to!r}; there are {have}")
        links.append(Link(index[unit], part.inputs.index(port), columns[source]))
    driven = {(link.to, link.input) for link in links}
    for i, p in enumerate(parts):
        for k, port in enumerate(p.inputs):
            if (i, k) not in driven and port not in p.constants:
                raise InputError(
                    f"{where}: nothing is connected to '{p.name}.{port}'; connect it or give it a constant value in "
                    f"units.{p.name}.inputs"
                )
    return tuple(sorted(links, key=lambda link: (link.to, link.input)))


@dataclass(frozen=True)
class Delay:
    """What delays a signal: `steps` of the base step, on the connection or in the unit `where`."""

    where: str
    steps: float
    text: str


def delay_budget(system: System) -> list[Delay]:
    """Every delay in the system, from order, wiring and rates: held values, delay blocks, the hold of the command.

    A connection to a unit that stands earlier in the order carries the value of the last step.  For a unit that does
    not feed that input through (a plant with dynamics) this is the command held since its sample: no delay but the
    hold.  For one that does, it is one step late.
    """
    owner = {p.first + i: (k, n) for k, p in enumerate(system.parts) for i, n in enumerate(p.outputs)}
    ripple = system.case.ripple
    found: list[Delay] = []
    for link in system.links:
        to, (k, name) = system.parts[link.to], owner[link.source]
        source = system.parts[k]
        if k < link.to:
            continue
        where = f"{source.name}.{name} -> {to.name}.{to.inputs[link.input]}"
        held = source.period / ripple
        if _feeds_through(system, to, link.input):
            found.append(Delay(where, held, "one step of its source late: the reader stands earlier in the order"))
        else:
            found.append(Delay(where, held / 2, "held between samples: half a step on average"))
    for part in system.parts:
        for node in part.graph.nodes:
            if node.type == "delay":
                steps = node.dims["n"] * part.period / ripple
                found.append(Delay(part.name, steps, f"delay block of {node.dims['n']} steps of the unit"))
    return found


def _feeds_through(system: System, part: Part, k: int) -> bool:
    """Whether an output of the unit that somebody reads depends on its input k at once."""
    port = next(p for p in part.graph.ports if p.kind == "input" and part.inputs[k] in p.scalar_names)
    read = {link.source for link in system.links}
    read |= {system.columns[m.signal] for m in system.case.metrics.values()}
    depends = part.graph.dependencies()
    return any(
        port.name in depends[p.name] and any(system.columns[f"{part.name}.{n}"] in read for n in p.scalar_names)
        for p in part.graph.ports
        if p.kind == "output"
    )


# ---- the graph of a unit ------------------------------------------------------------------------------------------
def _source(case: Case, spec: UnitSpec, where: str) -> Graph | Foreign:
    if spec.fmu is not None:
        return Foreign.load(inside(case.folder, spec.fmu, f"{where}.fmu"))
    if spec.model is not None:
        return Model.load(inside(case.folder, spec.model, f"{where}.model")).graph
    if spec.inverse_of is not None:
        from hystfmu.inverse import inverse  # the method's own imports stay out of scenarios that do not use it

        return inverse(Model.load(inside(case.folder, spec.inverse_of, f"{where}.inverse_of")), "exact").graph
    if spec.block is not None:
        return Graph.single(Node(spec.block, spec.block, spec.dims, spec.values))
    assert spec.graph is not None
    return spec.graph.graph()


def _names(graph: Graph | Foreign, kind: str) -> tuple[str, ...]:
    return tuple(n for p in graph.ports if p.kind == kind for n in p.scalar_names)


def _starts(graph: Graph | Foreign, kind: str) -> list[float]:
    return [s for p in graph.ports if p.kind == kind for s in p.start]


def _parameter_names(graph: Graph | Foreign) -> set[str]:
    if isinstance(graph, Foreign):
        return {v.name for v in graph.description.modelVariables if v.causality == "parameter"}
    ports = [p for p in graph.ports if p.kind in ("param", "fixed")]
    return {p.name for p in ports} | {n for p in ports for n in p.scalar_names}


def _with_values(graph: Graph | Foreign, values: dict[str, Any]) -> Graph | Foreign:
    """The unit with some parameters changed, by the names that an importer would use (`w`, `w_2`, `net_W1`)."""
    if isinstance(graph, Foreign):
        return graph.with_settings(values)
    for name, value in values.items():
        port, element = _parameter(graph, name)
        node = graph.nodes[port.node]
        graph = graph.replace(node.with_values(**{port.var.name: _changed(node, port, element, value)}))
    return graph


def changed(graph: Graph, name: str, value: object) -> tuple[Port, int, list[float]]:
    """A parameter after a change that a scenario's `set` could ask for.

    Returns
    -------
    port : Port
    first : int
        The first element of the port that changes.
    values : list of float
        Its new value and those of the elements after it.

    Raises
    ------
    InputError
        No such parameter, value out of range.
    """
    port, element = _parameter(graph, name)
    node = graph.nodes[port.node]
    new = node.with_values(**{port.var.name: _changed(node, port, element, value)})
    values = new.value(port.var.name).tolist()
    return (port, 0, values) if element is None else (port, element, values[element : element + 1])


def _parameter(graph: Graph, name: str) -> tuple[Port, int | None]:
    parameters = [p for p in graph.ports if p.kind in ("param", "fixed")]
    for p in parameters:
        if name == p.name:
            return p, None
        if name in p.scalar_names:
            return p, p.scalar_names.index(name)
    raise InputError(f"no parameter {name!r}; there are {', '.join(p.name for p in parameters)}")


def _changed(node: Node, port: Port, element: int | None, value: object) -> Value:
    old = node.value(port.var.name)
    if isinstance(value, str) and value.startswith("*"):
        try:
            new: object = old * float(value[1:])
        except ValueError:
            raise InputError(f"{port.name}: after '*' stands a number; got {value!r}") from None
        if element is not None:
            new = float(np.asarray(new)[element])
    else:
        new = value
    if element is None:
        return new  # type: ignore[return-value]  # Node checks kind, length and range
    if not isinstance(new, int | float):
        raise InputError(f"{port.name}: one element takes one number; got {value!r}")
    old[element] = new
    return old


# ---- the whole as one graph -----------------------------------------------------------------------------------------
def fuse(system: System, parts: tuple[int, ...]) -> tuple[Graph, list[tuple[int, int]]]:
    """Some units of one period as one graph, in their order.

    Returns
    -------
    graph : Graph
        Blocks are called `unit_block`, outputs `unit_output`, inputs `unit_input`.
    outside : list of (part, input)
        Which inputs of which units became inputs of the graph, in the order of the graph's inputs: those with a source
        outside, and constants (whose value is the start value).
    """
    nodes: list[Node] = []
    wires: list[tuple[str, str]] = []
    inputs: list[Input] = []
    outputs: list[Output] = []
    outside: list[tuple[int, int]] = []
    owner = {p.first + i: (k, i) for k, p in enumerate(system.parts) for i in range(len(p.outputs))}
    source = {(link.to, link.input): link.source for link in system.links}
    for k in parts:
        part = system.parts[k]
        g, name = part.own, part.name
        nodes += [Node(f"{name}_{n.name}", n.type, n.dims, n.values) for n in g.nodes]
        wires += [(f"{name}_{a}", f"{name}_{b}") for a, b in g.wires]
        for i, (_, end, port) in enumerate(_scalars(g)):
            outputs.append(Output(f"{name}_{part.outputs[i]}", f"{name}_{end}", port.unit, port.text))
        for i, ends in enumerate(_input_ends(g)):
            ends = [f"{name}_{e}" for e in ends]
            at = source.get((k, i))
            if at is not None and owner[at][0] in parts:
                other = system.parts[owner[at][0]]
                end = _scalars(other.own)[owner[at][1]][1]
                wires += [(f"{other.name}_{end}", e) for e in ends]
            else:
                start = part.constants.get(part.inputs[i], 0.0)
                inputs.append(Input(f"{name}_{part.inputs[i]}", tuple(ends), start=start))
                outside.append((k, i))
    return Graph(nodes, wires, inputs, outputs, sort=False), outside


def segments(system: System) -> list[tuple[int, ...]]:
    """Neighbours in the order that have the same period: each can be one graph without changing any value.

    A unit that feeds a value of the last step through (it stands before the unit that makes it) would be an algebraic
    loop inside one graph: it and its source come into different ones.
    """
    owner = {p.first + i: k for k, p in enumerate(system.parts) for i in range(len(p.outputs))}
    early = [(n.to, owner[n.source], n.input) for n in system.links if owner[n.source] >= n.to]
    held = [(to, source) for to, source, i in early if _feeds_through(system, system.parts[to], i)]
    groups: list[list[int]] = []
    for k, part in enumerate(system.parts):
        last = system.parts[groups[-1][-1]] if groups else part
        fits = groups and last.period == part.period and not isinstance(part.graph, Foreign)
        fits = fits and not isinstance(last.graph, Foreign)
        if fits and not any(source == k and to in groups[-1] for to, source in held):
            groups[-1].append(k)
        else:
            groups.append([k])
    return [tuple(g) for g in groups]


def to_graph(system: System) -> Graph:
    """The closed loop as one graph, when all its units have the same period: one FMU of the whole loop.

    Raises
    ------
    InputError
        If the units run at different rates: a graph has one step.
    """
    if len({p.period for p in system.parts}) > 1 or system.h != system.length(system.parts[0]):
        rates = {p.name: p.period for p in system.parts}
        raise InputError(f"{system.case.title}: units of different rates do not fit into one graph: {rates}")
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
