"""Parts of a graph: nodes, which are blocks with sizes and parameter values, and ports, which an importer accesses."""

from __future__ import annotations

import ctypes as C
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from hystfmu.base import Array, InputError, checked, meant
from hystfmu.core.library import BlockType, Var, block_types


def element_names(name: str, size: int) -> tuple[str, ...]:
    """Return the names of the elements of a variable: `w` for a scalar, and `w_1`, `w_2`, ... for an array."""
    return (name,) if size == 1 else tuple(f"{name}_{i + 1}" for i in range(size))


@checked
@dataclass(frozen=True)
class Input:
    """An input of a graph.

    Parameters
    ----------
    name : str
        Name of the port.
    to : tuple of str
        Inputs of blocks to which the input is connected, such as "hysteresis.u".
    unit : str
        Unit of measure.
    start : float
        Start value.
    text : str
        Description.
    starts : tuple of float
        Start values of the elements of an array, which replace `start`. Model files do not store them.

    Examples
    --------
    >>> import hystfmu as hy
    >>> hy.Input("u", to=("hysteresis.u",), unit="V").name
    'u'
    """

    name: str
    to: tuple[str, ...]
    unit: str = ""
    start: float = 0.0
    text: str = ""
    starts: tuple[float, ...] = ()


@checked
@dataclass(frozen=True)
class Output:
    """An output of a graph.

    Parameters
    ----------
    name : str
        Name of the port.
    source : str
        Output of a block to which the output is connected, such as "hysteresis.y".
    unit : str
        Unit of measure.
    text : str
        Description.

    Examples
    --------
    >>> import hystfmu as hy
    >>> hy.Output("y", source="hysteresis.y", unit="um").source
    'hysteresis.y'
    """

    name: str
    source: str
    unit: str = ""
    text: str = ""


@dataclass(frozen=True)
class Port:
    """A variable of a graph that an importer of the FMU can access. Each element has a value reference.

    Attributes
    ----------
    name, kind, text : str
        Name, kind (param, fixed, input or output) and description.
    node : int
        Index of the block in the graph.
    var : Var
        Row of the variable in the table of the block.
    place : int
        Index of the first element. For an input, it is counted over all inputs of the graph; otherwise, it is counted
        in the variable of the block.
    reference, size : int
        Value reference of the first element, and number of elements.
    unit : str
        Unit of measure.
    start : tuple of float
        Start values, one for each element.
    """

    name: str
    kind: str
    node: int
    var: Var
    place: int
    reference: int
    size: int
    unit: str
    text: str
    start: tuple[float, ...]

    @property
    def is_parameter(self) -> bool:
        """True if the variable is a parameter, tunable or fixed."""
        return self.kind in ("param", "fixed")

    @property
    def scalar_names(self) -> tuple[str, ...]:
        """Names of the elements of the variable."""
        return element_names(self.name, self.size)


@dataclass(frozen=True)
class ContinuousState:
    """One continuous state of a graph, with its name in Model Exchange. The name of its derivative is `der(name)`."""

    name: str
    unit: str
    text: str


Value = float | int | bool | str | Sequence[float] | Array

_MOST_VALUES = 1 << 24  # maximum number of values of a block, as in graph_file.c
_LENGTH = re.compile(r"(\w+)(?: \+ (\d+))?\Z")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")


MOST_ELEMENTS, MOST_VALUES = 3, 6  # maximum number of elements of an array, and of values of a block, in a repr


def shown(values: Mapping[str, Any]) -> list[str]:
    """Return texts ``name=value`` for a repr. Long arrays and long lists of values are shortened."""
    found = [f"{k}={_short(v)}" for k, v in list(values.items())[:MOST_VALUES]]
    return [*found, "..."] if len(values) > MOST_VALUES else found


def _short(value: Any) -> str:
    if np.ndim(value):
        more = f", ... {np.size(value)} values" if np.size(value) > MOST_ELEMENTS else ""
        return f"[{', '.join(map(_short, np.ravel(value)[:MOST_ELEMENTS].tolist()))}{more}]"
    value = value.item() if isinstance(value, np.generic) else value
    return repr(float(f"{value:.6g}")) if isinstance(value, float) else repr(value)


def block_type(name: str) -> BlockType:
    """Return the block called `name`.

    Raises
    ------
    InputError
        There is no such block; the message lists the blocks.
    """
    types = block_types()
    if name not in types:
        raise InputError(
            f"The type of a block must be one of {', '.join(types)} ('hystfmu blocks'). Got {name!r} instead."
            f"{meant(name, types)}"
        )
    return types[name]


def _is_whole(n: Any) -> bool:
    """Return whether a value of any type is equal to an integer."""
    try:
        return not isinstance(n, bool) and bool(int(n) == n)
    except (TypeError, ValueError, OverflowError):  # not a number, or NaN, or infinity
        return False


@checked
@dataclass(frozen=True)
class Node:
    """One block of a graph, with its sizes and parameter values.

    Parameters
    ----------
    name : str
        Name of the node, unique in the graph.
    type : str
        Name of the block type, e.g. ``"prandtl_ishlinskii"``.
    dims : mapping of str to int
        Sizes by name. A missing size follows from the length of an array in `values`; otherwise it is the default.
    values : mapping
        Parameter values by name. A missing parameter has its default value. The value of an enumeration is a string.

    Raises
    ------
    InputError
        The type, a parameter or a size is unknown, an array has a wrong length, or a value is out of range.

    Examples
    --------
    >>> import hystfmu as hy
    >>> hy.Node("hysteresis", "backlash_sum", values={"w0": 0.4, "r": [0.1, 0.3], "w": [0.5, 0.2]})
    Node('hysteresis', 'backlash_sum', n=2, w0=0.4, r=[0.1, 0.3], w=[0.5, 0.2])
    """

    name: str
    type: str
    dims: Mapping[str, int] = field(default_factory=dict)
    values: Mapping[str, Value] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not _NAME.match(self.name):
            raise InputError(
                f"The name of a block must be a letter followed by letters, digits or _. Got {self.name!r} instead."
            )
        kind = self.block  # raises InputError for an unknown type
        unknown = set(self.dims) - {d.name for d in kind.dims}
        if unknown:
            names = [d.name for d in kind.dims]
            raise InputError(f"A size of {self.type} must be one of {names}. Got {sorted(unknown)[0]!r} instead.")
        unknown = set(self.values) - {v.name for v in kind.parameters}
        if unknown:
            names = [v.name for v in kind.parameters]
            beside = f" (sizes: {', '.join(d.name for d in kind.dims)})" if kind.dims else ""
            wrong = sorted(unknown)[0]
            raise InputError(
                f"A parameter of {self.type} must be one of {', '.join(names)}{beside}. Got {wrong!r} instead."
                f"{meant(wrong, names)}"
            )
        object.__setattr__(self, "dims", self._complete_dims())
        sizes = self.sizes
        if sum(sizes.values()) > _MOST_VALUES:
            raise InputError(
                f"The sizes of {self.name} must make at most {_MOST_VALUES} values. Got too many values with "
                f"{dict(self.dims)}."
            )
        for v in kind.parameters:
            self._flat(v, sizes[v.name])

    def __repr__(self) -> str:
        return f"Node({', '.join([repr(self.name), repr(self.type), *shown({**self.dims, **self.values})])})"

    @property
    def block(self) -> BlockType:
        """Type of the block, with its description.

        Raises
        ------
        InputError
            There is no block of this type.
        """
        return block_type(self.type)

    def _complete_dims(self) -> dict[str, int]:
        dims = dict(self.dims)
        for v in self.block.parameters:  # the length of an array of the size n or n + 1 gives n
            m = _LENGTH.match(v.size)
            if m and v.name in self.values and m[1] not in dims and m[1] in {d.name for d in self.block.dims}:
                dims[m[1]] = int(np.size(np.asarray(self.values[v.name]))) - int(m[2] or 0)
        for d in self.block.dims:
            n = dims.setdefault(d.name, d.start)
            if not _is_whole(n) or not d.lo <= n <= d.hi:
                wanted = f"an int in [{d.lo}, {d.hi}]"
                raise InputError(f"The '{d.name}' size of {self.name} must be {wanted}. Got {n} instead.")
            dims[d.name] = int(n)
        return dims

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Number of elements of every variable."""
        return self.block.sizes(self.dims)

    def _flat(self, v: Var, size: int) -> Array:
        value = self.values.get(v.name, v.start)
        if isinstance(value, str):
            if value not in v.choices:
                wanted = f"one of {list(v.choices)}" if v.choices else "a number"
                raise InputError(f"The '{v.name}' parameter of {self.name} must be {wanted}. Got {value!r} instead.")
            value = v.choices.index(value)
        try:
            array = np.asarray(value, dtype=np.float64).ravel()
        except (TypeError, ValueError):
            raise InputError(
                f"The '{v.name}' parameter of {self.name} must be a number or an array of them. Got {value!r} instead."
            ) from None
        except OverflowError:  # the message leaves out an integer of hundreds of digits
            raise InputError(
                f"The '{v.name}' parameter of {self.name} must be {v.interval}. Got too large an integer instead."
            ) from None
        if array.size == 1 and size != 1 and not isinstance(value, list):  # in a list other values may be missing
            array = np.broadcast_to(array, (size,))
        if array.size != size:
            raise InputError(
                f"The '{v.name}' parameter of {self.name} must have {size} values. Got {array.size} instead."
            )
        bad = ~(np.isfinite(array) & (array >= v.lo) & (array <= v.hi))
        if v.type != "real":
            bad |= array != np.floor(array)
        if bad.any():
            got = array[bad][0]
            raise InputError(f"The '{v.name}' parameter of {self.name} must be {v.interval}. Got {got:.10g} instead.")
        return array

    def parameters(self) -> Array:
        """Return the values of all parameters in the order of the table, as one array of shape (n,)."""
        sizes = self.sizes
        return np.concatenate([self._flat(v, sizes[v.name]) for v in self.block.parameters] or [np.zeros(0)])

    def value(self, name: str) -> Array:
        """Return the value of the parameter `name` as an array of shape (n,).

        Raises
        ------
        InputError
            The block has no parameter with this name.
        """
        rows = {v.name: v for v in self.block.parameters}
        if name not in rows:
            raise InputError(f"A parameter of {self.type} must be one of {list(rows)}. Got {name!r} instead.")
        return self._flat(rows[name], self.sizes[name]).copy()

    def with_values(self, **values: Value) -> Node:
        """Return the same node with other values of the given parameters."""
        return Node(self.name, self.type, self.dims, {**self.values, **values})

    def feeds_through(self) -> bool:
        """Return whether the block has direct feed-through: an output depends on the inputs of the same step."""
        if not self.block.raw.feedthrough:
            return True
        dims, p = self.raw_arguments()
        return bool(self.block.raw.feedthrough(dims, p.ctypes.data_as(C.POINTER(C.c_double))))

    def raw_arguments(self) -> tuple[C.Array[C.c_int], Array]:
        """Return the arrays of sizes and parameters for the C functions of the block.

        The array of parameters ends with a 0 for each element that the block itself derives from its parameters.
        """
        sizes, kind = self.sizes, self.block
        derived = sum(sizes[v.name] for v in kind.of("derived"))
        return kind.raw_dims(self.dims), np.concatenate([self.parameters(), np.zeros(derived)])
