"""A case made ready to run: a graph per unit, connections as indices, the grid of times.

The grid has the fine step h/ripple. The period of a unit is 1 fine step (fine), ripple fine steps (normal), or ripple *
every fine steps (slow). At fine step n, every unit whose period divides n runs over the period that ends at this step.
The units run in the stated order, with the newest values of their sources (Gauss-Seidel). All engines work in this way.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, TypeVar

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.graph import Graph
from hystfmu.graph.graph import is_sampled
from hystfmu.scenario.system.case import Case, split_end
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.unit_graph import (
    first_outputs,
    parameter_names,
    sizes,
)

T = TypeVar("T")
Rows = np.ndarray[Any, np.dtype[np.int64]]
CHUNK_VALUES, SHORTEST_CHUNK = 1 << 17, 512  # of a chunk of rows: doubles, and rows at least


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
        """True if the steps of the unit can be divided: the unit runs at the finest rate and has no sampled block."""
        if isinstance(self.graph, Foreign):
            return self.period == 1 and self.graph.any_step
        return self.period == 1 and not is_sampled(self.graph)

    @property
    def has_tangent(self) -> bool:
        """True if the unit has tangents (directional derivatives). A sampled unit has no tangents."""
        return self.graph.has_tangent if isinstance(self.graph, Foreign) else not is_sampled(self.graph)


@dataclass(frozen=True)
class Link:
    """A connection: input `input` of part `to` reads value `source` of the system."""

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
        """Names `unit.parameter` of all parameters that `set` may change."""
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
        """Times of fine steps: a whole number of steps, then fine steps, so that samples do not drift."""
        whole, rest = np.divmod(rows, self.case.ripple)
        return np.asarray(whole * self.case.step + rest * self.h)

    def times(self, first: int, end: int) -> Array:
        """Return the times `at` the fine steps first ... end - 1, shape (end - first,)."""
        ripple = self.case.ripple
        begin = first // ripple
        whole = np.arange(begin, -(-end // ripple)) * self.case.step
        times = (whole[:, None] + np.arange(ripple) * self.h).ravel()  # a division of every row would cost more
        return times[first - begin * ripple :][: end - first]

    def rows(self, t: Array) -> Rows:
        """Return for every time in [0, stop] the first fine step at or after it, shape (n,)."""
        n = np.clip(np.ceil(t / self.h).astype(np.int64), 0, self.n_steps)
        n = np.where((n > 0) & (self.at(n - 1) >= t), n - 1, n)  # the quotient is rounded
        return np.where((n < self.n_steps) & (self.at(n) < t), n + 1, n)

    def chunks(self) -> Iterator[tuple[int, int]]:
        """Yield first fine step and end of each chunk of rows.

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
        """Return whether the reader reads the value at the end of its step.

        This is so if the source precedes the reader, or if the coupling is iterative.
        """
        scheme = self.case.coupling.scheme
        return scheme == "iterative" or (scheme != "jacobi" and link.source < self.parts[link.to].first)

    def maker(self, link: Link) -> Part:
        """The unit whose output a connection reads."""
        return next(p for p in reversed(self.parts) if p.first <= link.source and p.outputs)

    @cached_property
    def names(self) -> dict[int, str]:
        """Names `unit.output` by the index of the value."""
        return {place: end for end, place in self.columns.items()}

    @cached_property
    def owners(self) -> dict[int, int]:
        """Unit that computes each value."""
        return {p.first + i: k for k, p in enumerate(self.parts) for i in range(len(p.outputs))}

    def early(self) -> Array:
        """Indices of the values that a unit reads before their source has stepped (in the stated order)."""
        owner = self.owners
        return np.array(sorted({n.source for n in self.links if owner[n.source] >= n.to}), dtype=np.int64)

    def makers(self) -> Array:
        """Source of each value that is read early."""
        owner = self.owners
        return np.array([owner[j] for j in self.early().tolist()], dtype=np.int64)

    def loops(self) -> frozenset[int]:
        """Units in the loops of iterative coupling, on paths between values that are read early."""
        owner, early = self.owners, set(self.early().tolist())
        after = {n.to for n in self.links if n.source in early}
        before = {owner[j] for j in early}
        for _ in self.parts:
            after |= {n.to for n in self.links if owner[n.source] in after}
            before |= {owner[n.source] for n in self.links if n.to in before}
        return frozenset(after & before)

    @property
    def newton(self) -> bool:
        """True if sweeps use Newton's method, that is, if every unit in a loop has tangents."""
        loops = self.loops() if self.case.coupling.scheme == "iterative" else frozenset()
        return bool(loops) and all(self.parts[k].has_tangent for k in loops)

    def feeds_through(self, part: Part, k: int) -> bool:
        """Return whether the unit has direct feed-through from its input k to an output that is read."""
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
        return np.array([s for p in self.parts for s in first_outputs(p.graph)], dtype=np.float64)


def signals(case: Case) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the outputs that a case names, by key."""
    yield "record", case.record
    for pair in case.loops:
        yield "loops", pair
    for name, m in case.metrics.items():
        yield f"metrics.{name}", (m.signal,) if m.against is None else (m.signal, m.against)


def behind(edges: Iterable[tuple[T, T]], *first: T) -> set[T]:
    """Return the ends downstream of some ends of connections. A given end is included only if it acts on itself."""
    edges, found = list(edges), set[T]()
    while more := {b for a, b in edges if a in found or a in first} - found:
        found |= more
    return found
