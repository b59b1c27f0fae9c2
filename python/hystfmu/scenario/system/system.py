"""A case as a system for the simulation: one graph per unit, connections as indices, and the time grid.

The grid has the fine step h/ripple. The period of a unit is 1 fine step (fine), ripple fine steps (normal), or ripple *
every fine steps (slow). At fine step n, every unit whose period divides n makes a step over the period that ends at n.
The units make their steps in the stated order, with the newest values of their sources (Gauss-Seidel). All engines use
this scheme.

The function `build` loads the units of a case and connects them. The function `fuse` joins units to one graph. These
units are neighbours that can step as one block, or the whole closed loop.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.graph import Graph, Input, Node, Output, Port
from hystfmu.graph.graph import is_sampled
from hystfmu.scenario.system import case as cases
from hystfmu.scenario.system.case import SIZE, Case, parameter_names, sizes, split_end, with_values
from hystfmu.scenario.system.foreign import Foreign

T = TypeVar("T")
Rows = np.ndarray[Any, np.dtype[np.int64]]
CHUNK_VALUES, SHORTEST_CHUNK = 1 << 17, 512  # largest number of values in a chunk of rows, and smallest number of rows


@dataclass(frozen=True)
class Part:
    """One unit of a system."""

    name: str
    graph: Graph | Foreign
    runs_as: Literal["fmu2", "fmu3"]
    period: int
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    constants: dict[str, float]
    first: int
    """Index of the first output of the unit among all values of the system."""
    substeps: int = 1
    hold: Literal["zero", "first"] = "zero"

    @property
    def own(self) -> Graph:
        """Graph of a unit that is not a foreign FMU.

        Raises
        ------
        InputError
            The unit is a foreign FMU.
        """
        if isinstance(self.graph, Foreign):
            raise InputError(f"{self.name}: {self.graph.path} is an FMU: it cannot become a part of a graph")
        return self.graph

    @property
    def any_step(self) -> bool:
        """True if steps of the unit can be divided, that is, it has the finest rate and no sampled block."""
        if isinstance(self.graph, Foreign):
            return self.period == 1 and self.graph.any_step
        return self.period == 1 and not is_sampled(self.graph)

    @property
    def has_tangent(self) -> bool:
        """True if the unit has tangents (directional derivatives). A sampled unit has no tangents."""
        return self.graph.has_tangent if isinstance(self.graph, Foreign) else not is_sampled(self.graph)


@dataclass(frozen=True)
class Link:
    """A connection from value `source` of the system to input `input` of part `to`."""

    to: int
    input: int
    source: int


@dataclass(frozen=True)
class System:
    """A case with its graphs. The values of a system are the outputs of all units in the stated order."""

    case: Case
    parts: tuple[Part, ...]
    links: tuple[Link, ...]
    n_values: int
    columns: dict[str, int] = field(default_factory=dict)
    overridden: frozenset[str] = frozenset()
    """Overrides of the case whose parameter exists."""
    begins: tuple[float, ...] = ()
    """Values before the initialisation of the units; they replace the start values of the outputs."""

    def __repr__(self) -> str:
        return f"System({self.case.title!r}, units {', '.join(p.name for p in self.parts)}, {self.n_steps} steps)"

    @property
    def parameters(self) -> set[str]:
        """Names `unit.parameter` of all parameters that `set` can change."""
        return {f"{p.name}.{name}" for p in self.parts for name in parameter_names(p.graph)} | sizes(self.case)

    @property
    def h(self) -> float:
        """The fine step (s)."""
        return self.case.step / self.case.ripple if self.case.ripple > 1 else self.case.step

    @property
    def n_steps(self) -> int:
        """Number of fine steps."""
        return round(self.case.stop / self.case.step) * self.case.ripple

    def at(self, rows: Rows) -> Array:
        """Return the times of fine steps (s), computed from whole steps so that the samples do not drift."""
        whole, rest = np.divmod(rows, self.case.ripple)
        return np.asarray(whole * self.case.step + rest * self.h)

    def times(self, first: int, end: int) -> Array:
        """Return the times (s) of the fine steps first ... end - 1, shape (end - first,)."""
        ripple = self.case.ripple
        begin = first // ripple
        whole = np.arange(begin, -(-end // ripple)) * self.case.step
        times = (whole[:, None] + np.arange(ripple) * self.h).ravel()  # a division for every row would take longer
        return times[first - begin * ripple :][: end - first]

    def rows(self, t: Array) -> Rows:
        """Return for every time in [0, stop] the first fine step at or after it, shape (n,)."""
        n = np.clip(np.ceil(t / self.h).astype(np.int64), 0, self.n_steps)
        n = np.where((n > 0) & (self.at(n - 1) >= t), n - 1, n)  # corrects rounding of the quotient
        return np.where((n < self.n_steps) & (self.at(n) < t), n + 1, n)

    def chunks(self) -> Iterator[tuple[int, int]]:
        """Yield the first fine step and the end of each chunk of rows.

        The size of a chunk is bounded for runs of any length.
        """
        most = 1 << max(CHUNK_VALUES // max(self.n_values, 8), SHORTEST_CHUNK).bit_length() - 1
        end = self.n_steps + 1
        return ((first, min(first + most, end)) for first in range(0, end, most))

    def length(self, part: Part) -> float:
        """Return the step of a unit (s)."""
        return self.h if part.period < self.case.ripple else self.case.step * (part.period // self.case.ripple)

    def column(self, end: str, where: str) -> int:
        """Return the index of the output `unit.output` among the values."""
        if end not in self.columns:
            unit, _ = split_end(end, where)
            have = [c for c in self.columns if c.startswith(f"{unit}.")] or [p.name for p in self.parts]
            raise InputError(f"{where}: no output {end!r}; there are {', '.join(have)}")
        return self.columns[end]

    def fresh(self, link: Link) -> bool:
        """Return whether a unit uses the value of a source at the end of the step.

        This is true if the source precedes the unit in the order, or if the coupling is iterative.
        """
        scheme = self.case.coupling.scheme
        return scheme == "iterative" or (scheme != "jacobi" and link.source < self.parts[link.to].first)

    def maker(self, link: Link) -> Part:
        """Return the unit from which a connection comes."""
        return next(p for p in reversed(self.parts) if p.first <= link.source and p.outputs)

    @cached_property
    def names(self) -> dict[int, str]:
        """Names `unit.output` of all values, in the order of the values."""
        return {place: end for end, place in self.columns.items()}

    @cached_property
    def owners(self) -> dict[int, int]:
        """Index of the unit that computes each value."""
        return {p.first + i: k for k, p in enumerate(self.parts) for i in range(len(p.outputs))}

    @property
    def edges(self) -> list[tuple[int, int]]:
        """Indices of the source unit and the target unit of each connection."""
        return [(self.owners[n.source], n.to) for n in self.links]

    def early(self) -> Array:
        """Indices of the values that a unit uses before their source has made its step."""
        owner = self.owners
        return np.array(sorted({n.source for n in self.links if owner[n.source] >= n.to}), dtype=np.int64)

    def makers(self) -> Array:
        """Indices of the units that compute the values in `early`."""
        owner = self.owners
        return np.array([owner[j] for j in self.early().tolist()], dtype=np.int64)

    def loops(self) -> frozenset[int]:
        """Units in the loops of iterative coupling, which are on paths between the values in `early`."""
        owner, early = self.owners, set(self.early().tolist())
        readers, makers = {n.to for n in self.links if n.source in early}, {owner[j] for j in early}
        after = behind(self.edges, *readers) | readers
        return frozenset(after & (behind([(b, a) for a, b in self.edges], *makers) | makers))

    @property
    def newton(self) -> bool:
        """True if the sweeps use Newton's method, that is, if every unit in a loop has tangents."""
        loops = self.loops() if self.case.coupling.scheme == "iterative" else frozenset()
        return bool(loops) and all(self.parts[k].has_tangent for k in loops)

    def feeds_through(self, part: Part, k: int) -> bool:
        """Return whether a unit has direct feed-through from its input k to a connected output."""
        port = next(p for p in part.graph.ports if p.kind == "input" and part.inputs[k] in p.scalar_names)
        read = {link.source for link in self.links}
        read |= {self.columns[m.signal] for m in self.case.metrics.values()}
        depends = part.graph.dependencies()
        return any(
            port.name in depends[p.name] and any(self.columns[f"{part.name}.{n}"] in read for n in p.scalar_names)
            for p in part.graph.ports
            if p.kind == "output"
        )

    @property
    def foreign(self) -> tuple[Part, ...]:
        """Foreign FMUs among the units."""
        return tuple(p for p in self.parts if isinstance(p.graph, Foreign))

    def starts(self) -> Array:
        """Return the values before the initialisation of the units, shape (n_values,).

        The outputs of delays are already known. All other outputs have their start values.
        """
        if self.begins:
            return np.array(self.begins)
        return np.array([s for p in self.parts for s in cases.first_outputs(p.graph)], dtype=np.float64)


def signals(case: Case) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the keys of a case that name outputs, each with the names of these outputs."""
    yield "record", case.record
    for pair in case.loops:
        yield "loops", pair
    for name, m in case.metrics.items():
        yield f"metrics.{name}", (m.signal,) if m.against is None else (m.signal, m.against)


def behind(edges: Iterable[tuple[T, T]], *first: T) -> set[T]:
    """Return all ends of connections downstream of the given ends. A given end is included only if it is in a loop."""
    edges, found = list(edges), set[T]()
    while more := {b for a, b in edges if a in found or a in first} - found:
        found |= more
    return found


def build(case: Case) -> System:
    """Load the units of a case and connect them.

    Raises
    ------
    InputError
        A block, a port or a parameter is unknown, a value is out of range, or an input has no source. A path leads out
        of the folder of the scenarios. The case records hashes of final states, but contains a foreign FMU.
    """
    parts: list[Part] = []
    columns: dict[str, int] = {}
    overridden: set[str] = set()
    for name in case.order:
        spec = case.units[name]
        where = f"{case.where}: units.{name}"
        if (size := f"{name}.{SIZE}") in sizes(case):
            overridden |= {size} & case.overrides.keys()
            steps = case.overrides.get(size, spec.set.get(SIZE))
            spec = spec if steps is None else cases.delayed(spec, steps, case.ripple, f"{where}.set.{SIZE}")
        try:
            graph = cases.load_unit(case, spec, where)
            graph = with_values(graph, spec.set)
            for key, value in case.overrides.items():
                unit, parameter = split_end(key, "--set")
                if unit == name and key not in overridden and parameter in parameter_names(graph):
                    graph = with_values(graph, {parameter: value})
                    overridden.add(key)
            if not isinstance(graph, Foreign):
                graph.executor()  # refuses parameters that do not fit together
        except InputError as e:
            message = str(e)
            raise InputError(message if message.startswith(case.origin) else f"{where}: {message}") from None
        inputs, outputs = (cases.scalar_names(graph, kind) for kind in ("input", "output"))
        for key in spec.inputs:
            if key not in inputs:
                raise InputError(f"{where}.inputs: no input {key!r}; there are {list(inputs)}")
        period = 1 if spec.fine else case.ripple * spec.every
        first = len(columns)
        columns.update({f"{name}.{o}": first + i for i, o in enumerate(outputs)})
        constants = {k: float(v) for k, v in spec.inputs.items()}
        runs_as = spec.runs_as
        driven = {split_end(to, where)[1] for to in case.connections if to.startswith(f"{name}.")}
        starts = zip(inputs, cases.start_values(graph, "input"), strict=True)
        free = {k: v for k, v in starts if k not in driven | constants.keys()}
        if isinstance(graph, Foreign):  # an unconnected input has its start value
            constants |= {k: _kept(v, f"{where}: {k}") for k, v in free.items()}
            runs_as = "fmu2" if graph.fmi == 2 else "fmu3"
        elif spec.block is not None:  # a default value that is stated in the C table is used
            constants |= {k: v for k, v in free.items() if v != 0}
        parts.append(Part(name, graph, runs_as, period, inputs, outputs, constants, first, spec.substeps, spec.hold))
    _check_instances(case, parts)
    links = _links(case, parts, columns)
    system = System(case, tuple(parts), links, len(columns), columns, frozenset(overridden))
    _check_lines(system)
    if case.final_states and system.foreign:
        name = system.foreign[0].name
        raise InputError(f"{case.origin}: final_states: {name} is a foreign FMU, whose states are not known")
    where = case.where
    for key, ends in signals(case):
        for end in ends:
            system.column(end, f"{where}: {key}")
    for name, m in case.metrics.items():
        against = next((p for p in parts if m.lines and m.against and p.name == split_end(m.against, where)[0]), None)
        if against is not None and against.period > 1:
            raise InputError(
                f"{where}: metrics.{name}.lines: needs a reference with a new value in every row; {against.name} has "
                f"one in every {against.period} rows: set fine = true"
            )
    return system


def _check_instances(case: Case, parts: list[Part]) -> None:
    """Raise an InputError for a second instance of an FMU that supports one instance per process only."""
    first: dict[Path, str] = {}
    for p in parts:
        if not isinstance(p.graph, Foreign):
            continue
        used = p.graph.description.coSimulation or p.graph.description.modelExchange
        if used.canBeInstantiatedOnlyOncePerProcess and p.graph.folder in first:
            raise InputError(
                f"{case.where}: units.{p.name}: the FMU can be instantiated only once per process, and "
                f"{first[p.graph.folder]} is an instance of it"
            )
        first[p.graph.folder] = p.name


def _kept(start: float, where: str) -> float:
    """Return the start value of an unconnected input of a foreign FMU, as a number."""
    if not math.isfinite(start) or float(start) != start:
        raise InputError(f"{where}: connect it or give it a constant value: its start value {start} is not finite")
    return float(start)


def _check_lines(system: System) -> None:
    """Raise an InputError if a source of a first-order hold has a longer period than the unit with the hold."""
    for link in system.links:
        part, where = system.parts[link.to], f"{system.case.where}"
        if part.hold == "zero":
            continue
        source = system.maker(link)
        if source.period > part.period:
            raise InputError(
                f"{where}: units.{part.name}.hold: 'first' needs sources with the same step; {source.name} is slower"
            )


def _links(case: Case, parts: list[Part], columns: dict[str, int]) -> tuple[Link, ...]:
    where = f"{case.where}: connections"
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
            raise InputError(f"{where}: {to!r} must not be connected and have a constant value")
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


def fuse(system: System, parts: tuple[int, ...], own: bool = False) -> tuple[Graph, list[tuple[int, int]]]:
    """Join units with the same period to one graph. The order of the units does not change.

    If `own` is True, a connection from a unit to itself is not a part of the graph: the input is an external input. The
    names are `unit_block` for blocks, `unit_output` for outputs and `unit_input` for inputs. Also return the inputs of
    units that become inputs of the graph, in the order of the graph. These inputs have an external source or are
    constant. A constant is the start value of the input.
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
    """Return the text of an output that describes the unit, not the text of its block."""
    own = next(o.text for o in part.own.outputs if o.name == port.name)
    return own or f"{part.outputs[i]} of {part.name}" + (f", in {port.unit}" if port.unit else "")


def segments(system: System, cut: bool) -> list[tuple[int, ...]]:
    """Return groups of neighbours with the same period. Each group can be one graph without a change of any value.

    If steps are divided (`cut`), units that accept any step and all other units are in different groups. A unit that
    precedes its source in the order uses the value of the previous step. If the unit has direct feed-through, the unit
    and the source would form an algebraic loop in one graph. Therefore they are in different groups.
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
        raise InputError(f"{system.case.title}: all units of one graph must have the same rate; got {rates}")
    for p in system.parts:
        if (p.substeps, p.hold) != (1, "zero"):
            raise InputError(f"{system.case.title}: {p.name} must have no substeps and no hold = 'first' in one graph")
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
    """Return the ends of connections in the graph for every scalar input."""
    ends = []
    for i in graph.inputs:
        size = graph.port(i.name).size
        ends += [[e if size == 1 else f"{e}[{k + 1}]" for e in i.to] for k in range(size)]
    return ends
