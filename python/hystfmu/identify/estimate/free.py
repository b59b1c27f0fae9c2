"""Free parameters of a graph: their names, bounds, scales and constraints as given by a user, and their checks.

The name of a free parameter is ``node.parameter``, or ``node.parameter[i]`` for one element of an array, counted
from 1. Its value is True, a pair (lower, upper), or a table with some of these keys:

  lower, upper   bounds; the default of a bound depends on the block, the record and the value in the graph,
  scale          "log" to search the logarithm, or "linear"; the default is "log" for positive parameters,
  rising         True if the elements of an array must not decrease,
  sum            the sum of the elements of an array, which must then be positive.

A file of a graph with free parameters contains the tables of a model file, and a table ``[free]``.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from hystfmu.base import Array, InputError, check, check_format, load_toml, meant
from hystfmu.core.library import Var
from hystfmu.graph import Graph
from hystfmu.model import FORMAT, ModelTable

KEYS = ("lower", "upper", "scale", "rising", "sum")
SCALES = ("linear", "log")
_NAME = re.compile(r"([A-Za-z][A-Za-z0-9_]*)\.([A-Za-z][A-Za-z0-9_]*)(?:\[(\d+)\])?\Z")

Spec = bool | Sequence[float] | Mapping[str, Any]
"""Specification of a free parameter: True, (lower, upper) or a table."""


@dataclass(frozen=True)
class Free:
    """One free parameter: the names of its node and its parameter, and its settings as the user gave them.

    `elements` contains the indices, from 0, of the free elements of an array with `whole` elements. `start` (n,)
    contains the values of these elements in the graph. `row` is the description of the parameter in its block: type,
    limits and unit of measure.
    """

    name: str
    node: str
    parameter: str
    elements: tuple[int, ...]
    row: Var
    start: Array
    whole: int
    lower: float | None = None
    upper: float | None = None
    scale: str | None = None
    rising: bool = False
    sum: float | None = None

    @property
    def place(self) -> str:
        """Name of the parameter, ``node.parameter``."""
        return f"{self.node}.{self.parameter}"

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the single free elements, counted from 1."""
        if self.whole == 1:
            return (self.place,)
        return tuple(f"{self.place}[{k + 1}]" for k in self.elements)

    @property
    def rises(self) -> bool:
        """True if the elements must not decrease, because the user or the block requires it."""
        return len(self.elements) > 1 and (self.rising or "not decreasing" in self.row.text)

    @property
    def lo(self) -> float:
        """Smallest value that the block and the given bounds permit."""
        least = self.row.lo if self.lower is None else max(self.lower, self.row.lo)
        return max(least, 0.0) if self.sum is not None else least

    @property
    def hi(self) -> float:
        """Largest value that the block and the given bounds permit."""
        return self.row.hi if self.upper is None else min(self.upper, self.row.hi)


def read(graph: Graph, given: Mapping[str, Spec]) -> tuple[Free, ...]:
    """Check the specifications `given` for free parameters of a graph, and return these parameters.

    An InputError is raised for an unknown node or parameter, for a size or another structural parameter, and for an
    invalid table. It is also raised if bounds exclude the value in the graph, if an element is named twice, and if no
    parameter is free.
    """
    if not given:
        raise InputError("The free parameters must be at least one, e.g. free={'node.parameter': True}. Got none.")
    found: list[Free] = []
    for name, spec in given.items():
        free = _read(graph, str(name), spec)
        for other in found:
            if other.place == free.place and {*other.elements} & {*free.elements}:
                raise InputError(f"A free parameter must be named once. Got {other.name!r} and {free.name!r}.")
        found.append(free)
    return tuple(found)


def _read(graph: Graph, name: str, spec: Spec) -> Free:
    m = _NAME.match(name)
    nodes = [n.name for n in graph.nodes]
    if not m or m[1] not in nodes:
        raise InputError(
            f"A free parameter must be named node.parameter, with a node of {', '.join(nodes)}. Got {name!r} instead."
            f"{meant(name.partition('.')[0], nodes)}"
        )
    node = graph.node(m[1])
    rows = {v.name: v for v in node.block.parameters}
    if m[2] in node.dims:
        raise InputError(f"A free parameter must not be a size. Got {name!r}: fit one graph for each size.")
    if m[2] not in rows:
        raise InputError(
            f"A free parameter of {node.name} must be one of {', '.join(rows) or 'none'}. Got {m[2]!r} instead."
            f"{meant(m[2], list(rows))}"
        )
    row = rows[m[2]]
    if row.type != "real":
        kind = f"a choice of {', '.join(row.choices)}" if row.choices else f"of type {row.type}"
        raise InputError(f"A free parameter must be a real number. Got {name!r}, which is {kind}.")
    values = node.value(m[2])
    if m[3] is not None and not 1 <= int(m[3]) <= len(values):
        raise InputError(f"The index of {name!r} must be in 1..{len(values)}. Got {m[3]} instead.")
    elements = tuple(range(len(values))) if m[3] is None else (int(m[3]) - 1,)
    free = Free(name, m[1], m[2], elements, row, values[list(elements)], len(values), **_table(name, spec))
    _check_start(free)
    return free


def _table(name: str, spec: Spec) -> dict[str, Any]:
    if spec is True:
        return {}
    if isinstance(spec, Mapping):
        table = dict(spec)
    elif isinstance(spec, Sequence) and not isinstance(spec, str) and len(spec) == 2:
        table = dict(zip(("lower", "upper"), spec, strict=True))
    else:
        raise InputError(f"The free parameter {name!r} must be true, [lower, upper] or a table. Got {spec!r} instead.")
    for key, value in table.items():
        if key not in KEYS:
            raise InputError(
                f"A key of the free parameter {name!r} must be one of {', '.join(KEYS)}. Got {key!r} instead."
                f"{meant(key, KEYS)}"
            )
        if key == "scale":
            right, rule = value in SCALES, "'linear' or 'log'"
        elif key == "rising":
            right, rule = isinstance(value, bool), "true or false"
        else:
            number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
            right, rule = number and not np.isnan(float(value)), "a number"
        if not right:
            raise InputError(f"The {key} of the free parameter {name!r} must be {rule}. Got {value!r} instead.")
    return {k: float(v) if k in ("lower", "upper", "sum") else v for k, v in table.items()}


def _check_start(free: Free) -> None:
    """Raise an InputError if bounds or constraints exclude the values in the graph."""
    lo, hi = free.lo, free.hi
    if free.lower is not None and free.upper is not None and not free.lower < free.upper:
        raise InputError(
            f"The lower bound of {free.name!r} must be below the upper bound. Got {free.lower:g} and {free.upper:g}: "
            "to fix the parameter, omit it."
        )
    if not ((lo <= free.start) & (free.start <= hi)).all():
        got = free.start[(free.start < lo) | (free.start > hi)][0]
        raise InputError(
            f"The bounds of {free.name!r} must contain its value in the graph, {got:g}. Got {lo:g} to {hi:g} instead."
        )
    if free.scale == "log" and not (free.start > 0).all():
        raise InputError(
            f"The value of {free.name!r} in the graph must be positive for the scale 'log'. Got {free.start.min():g}."
        )
    if free.rises and (np.diff(free.start) < 0).any():
        raise InputError(f"The values of {free.name!r} in the graph must not decrease, as they must rise.")
    if free.sum is not None:
        if free.rising or free.scale is not None:
            raise InputError(f"The free parameter {free.name!r} must have a sum alone, without scale or rising.")
        if not (free.start > 0).all() or not np.isclose(free.start.sum(), free.sum, rtol=1e-6):
            raise InputError(
                f"The values of {free.name!r} in the graph must be positive with the sum {free.sum:g}. "
                f"Got {free.start.sum():g}, the least {free.start.min():g}."
            )


def plain(spec: Spec) -> bool | list[float] | dict[str, Any]:
    """Convert the specification of a free parameter to a value for a TOML file."""
    if isinstance(spec, Mapping):
        return {k: v if isinstance(v, str | bool) else float(v) for k, v in spec.items()}
    return True if spec is True else [float(v) for v in spec]  # type: ignore[union-attr]


class _File(ModelTable):
    # a model file becomes the start of another fit if [free] is added
    free: dict[str, Any] = Field(min_length=1, max_length=1000)
    key: str = ""


def read_graph(path: Path) -> tuple[Graph, dict[str, Spec]]:
    """Read a graph and its free parameters from the file `path`; the blocks may have any order.

    An invalid file raises an InputError, whose message names the file, the key, the rule, and the invalid value.
    """
    table = load_toml(path)
    check_format(table, FORMAT, path, required=True)
    found = check(table, _File, path)
    try:
        graph = found.graph()
        graph = Graph(graph.nodes, graph.wires, graph.inputs, graph.outputs)
        read(graph, found.free)
    except InputError as e:
        raise InputError(f"{path}: {e}") from None
    return graph, found.free
