"""Binding of the shared library of the C core with ctypes, and access to its block tables.

Names and default values of the blocks come from the X-macro tables in `fmu_build/core/blocks`.
"""

import ctypes as C
import functools
import itertools
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from hystfmu.base import PACKAGE

KINDS = ("param", "fixed", "derived", "input", "time", "output", "cstate", "state")
RATES = ("function", "continuous", "hysteretic", "sampled")
STEP = 1
NO_LIMIT = 1e300  # this value means "no limit", because parameters must be finite; as in limit.h

_D = C.POINTER(C.c_double)
_I = C.POINTER(C.c_int)


def _fields(text: str) -> list[tuple[str, Any]]:
    """Return the fields of a ctypes structure from a text such as "name:s kind:i", in which letters state types."""
    kinds: dict[str, type] = {"s": C.c_char_p, "i": C.c_int, "h": C.c_ushort, "d": C.c_double, "p": C.c_void_p}
    return [(name, kinds[letter]) for name, _, letter in (word.partition(":") for word in text.split())]


class RawVar(C.Structure):
    """The structure `hyst_var` of hyst.h."""

    _fields_ = _fields("name:s kind:i type:s start:d lo:d hi:d size:s unit:s text:s")


class _Dim(C.Structure):
    _fields_ = _fields("name:s start:i lo:i hi:i text:s")


class _Told(C.Structure):
    _fields_ = _fields(
        "text:s equation:s source:s family:s inverts:s invert_condition:s tolerance:s hold:s "
        "rule_error:d rule_step:d smooth:d sensitivity:p derives:i differences:s"
    )


_OUTPUT = C.CFUNCTYPE(None, _I, _D, _D, _D, _D)


class _Block(C.Structure):
    _fields_ = [
        *_fields("name:s flags:h trial:h n_dims:i"),
        ("dims", C.POINTER(_Dim)),
        ("rate", C.c_int),
        ("n_vars", C.c_int),
        ("vars", C.POINTER(RawVar)),
        ("size", C.CFUNCTYPE(C.c_int64, _I, C.c_int)),
        ("prepare", C.CFUNCTYPE(C.c_char_p, _I, _D, C.c_double)),
        ("init", C.CFUNCTYPE(None, _I, _D, _D)),
        ("output", _OUTPUT),
        ("deriv", _OUTPUT),
        ("update", C.CFUNCTYPE(None, _I, _D, _D, _D, C.c_double)),
        ("feedthrough", C.CFUNCTYPE(C.c_int, _I, _D)),
        ("tangent", C.CFUNCTYPE(None, _I, _D, _D, _D, _D, _D, _D, _D)),
        ("told", _Told),
    ]


class RawError(C.Structure):
    """The structure `hyst_error` of graph.h."""

    _fields_ = [
        ("status", C.c_int),
        ("block", C.c_char * 64),
        ("variable", C.c_char * 64),
        ("text", C.c_char * 192),
        ("row", C.POINTER(RawVar)),
        ("value", C.c_double),
    ]


@dataclass(frozen=True)
class Var:
    """One variable of a block, that is, one row of the table in the C file.

    Attributes
    ----------
    name, text : str
        Name and description.
    kind : str
        One of `KINDS`.
    size : str
        Number of elements, as a C expression that may contain the names of the sizes of the block.
    type : str
        ``real``, ``int``, ``bool``, or the values of an enumeration separated by ``|``.
    unit : str
        Unit of measure; "1" or empty if there is none.
    follows : str
        Name of an input that always has the same unit of measure as this variable; "" if there is none.
    start, lo, hi : float
        Default value, lower and upper limit.
    raw : RawVar
        The row as a C structure.
    """

    name: str
    kind: str
    size: str
    type: str
    unit: str
    start: float
    lo: float
    hi: float
    text: str
    raw: RawVar = field(repr=False, compare=False)
    follows: str = ""

    @property
    def interval(self) -> str:
        """Description of the valid values, e.g. ``"a float in [0, inf)"``."""
        text = C.create_string_buffer(160)
        library().hyst_interval(C.byref(self.raw), text, len(text))
        return text.value.decode()

    @property
    def choices(self) -> tuple[str, ...]:
        """Names of the values of an enumeration, in ascending order of their numbers; empty for other types."""
        return tuple(self.type.split("|")) if "|" in self.type else ()


@dataclass(frozen=True)
class Dim:
    """One size of a block, such as the number of plays, with its default value and limits."""

    name: str
    start: int
    lo: int
    hi: int
    text: str


@dataclass(frozen=True)
class BlockType:
    """A type of block, with the description from its C file. `hyst_told` and `hyst_rate` in hyst.h define the fields.

    Attributes
    ----------
    family : str
        Folder of the C file: operators, inverses, networks, dynamics, controllers or sources.
    rate : str
        Behaviour of the block in continuous time: function, continuous, hysteretic or sampled.
    inverts, invert_condition : str or None
        Name of the block that this block inverts exactly, and the condition for it. The blocks `dead_zones` and
        `scaling` are inverses of themselves.
    tolerance : str
        Main cause of the numerical error: rounding, iteration or integration.
    rule_error, rule_step : float
        Bound of the relative error of the numerical integration, and time step (s) below which this error is
        negligible. A value of 0 means that no bound or step is stated. Both are stated only if `tolerance` is
        integration.
    smooth : float
        Distance from a point within which the tangent at this point is valid.
    trial : int
        Number of an input, counted from 1; 0 for most blocks. If it is not 0, the executor searches the output of the
        block for which this input equals the first input.
    hold : str
        Interpolation of the inputs within a step, zoh or foh, for blocks without a parameter `hold`.
    """

    name: str
    text: str
    equation: str
    source: str
    family: str
    rate: str
    inverts: str | None
    invert_condition: str | None
    tolerance: str
    rule_error: float
    rule_step: float
    smooth: float
    hold: str
    flags: int
    trial: int
    dims: tuple[Dim, ...]
    vars: tuple[Var, ...]
    raw: _Block

    @property
    def inverse(self) -> str | None:
        """Name of the block that inverts this block exactly. For an inverse, this is the name of the operator."""
        return next((b.name for b in block_types().values() if b.inverts == self.name), self.inverts)

    @property
    def inverse_condition(self) -> str | None:
        """Condition under which `inverse` is exact."""
        if self.inverts or self.inverse is None:
            return self.invert_condition
        return block_types()[self.inverse].invert_condition

    @property
    def tried(self) -> str | None:
        """Name of the input with the number `trial`, or None. A wire into this input closes no algebraic loop."""
        return self.of("input")[self.trial - 1].name if self.trial else None

    @property
    def rate_independent(self) -> bool:
        """True if the output depends on the path of the input, but not on time."""
        return self.rate in ("function", "hysteretic") and not self.of("time")

    @property
    def class_name(self) -> str:
        """Name of the block in CamelCase, for Python classes, Modelica classes and FMUs."""
        return "".join(w.capitalize() for w in self.name.split("_"))

    def of(self, *kinds: str) -> tuple[Var, ...]:
        """Return the variables of the given kinds, in the order of the table in the C file."""
        return tuple(v for v in self.vars if v.kind in kinds)

    @property
    def parameters(self) -> tuple[Var, ...]:
        """Tunable and fixed parameters of the block."""
        return self.of("param", "fixed")

    def parameter(self, name: str) -> Var | None:
        """Return the parameter with the name `name`; None if the block has no such parameter."""
        return next((v for v in self.parameters if v.name == name), None)

    def sizes(self, dims: Mapping[str, int]) -> dict[str, int]:
        """Return the number of elements of every variable, for the given sizes `dims` of the block."""
        values = self.raw_dims(dims)
        return {v.name: int(self.raw.size(values, i)) for i, v in enumerate(self.vars)}

    def raw_dims(self, dims: Mapping[str, int]) -> C.Array[C.c_int]:
        """Return the sizes as an array for the C functions of the block."""
        return (C.c_int * (len(self.dims) + 1))(*[dims[d.name] for d in self.dims])  # + 1: the array must not be empty


@functools.cache
def library() -> C.CDLL:
    """Return the compiled core, with declared argument types of its functions."""
    suffix = {"win32": "dll", "darwin": "dylib"}.get(sys.platform, "so")
    path = PACKAGE / f"_core.{suffix}"
    if not path.exists():
        raise ImportError(f"the compiled core {path.name} is missing: install the package with 'pip install .'")
    lib = C.CDLL(str(path))
    pointer, whole, real, size = C.c_void_p, C.c_int64, C.c_double, C.c_size_t
    error, status = C.POINTER(RawError), C.c_int
    for name, result, *arguments in (
        ("graph_measure", status, C.c_char_p, size, C.POINTER(size), error),
        ("graph_open", status, C.c_char_p, size, pointer, size, C.POINTER(pointer), error),
        ("message", status, error, C.c_char_p, size),
        ("interval", None, C.POINTER(RawVar), C.c_char_p, size),
        ("graph_error", error, pointer),
        ("graph_defaults", None, pointer),
        ("graph_start", status, pointer, real),
        ("graph_step", status, pointer, real, real),
        ("graph_end_of_step", real, pointer, real, real, real),
        ("graph_run", status, pointer, whole, real, real, pointer, pointer),
        ("graph_value", _D, pointer, whole),
        ("graph_set", status, pointer, whole, real),
        ("graph_state", _D, pointer, C.POINTER(whole)),
        ("graph_n_continuous", whole, pointer),
        ("graph_continuous", _D, pointer, whole),
        ("graph_is_sampled", status, pointer),
        ("graph_evaluate", None, pointer, real),
        ("graph_derivatives", None, pointer, pointer),
        ("graph_commit", None, pointer, real),
        ("graph_sample", status, pointer, real, real),
        ("graph_tangent", None, *[pointer] * 5),
        ("graph_tangent_between", None, pointer, real, *[pointer] * 5),
        ("sensitivity_measure", size, pointer, pointer),
        ("sensitivity_run", status, pointer, whole, real, real, *[pointer] * 3),
        ("columns_run", None, pointer, whole, pointer, whole, *[pointer] * 3),
    ):
        function = getattr(lib, f"hyst_{name}")
        function.restype, function.argtypes = result, arguments
    return lib


def _stated(raw: C.Structure) -> dict[str, Any]:
    """Return the fields of a C structure by name, with texts as str."""
    found = ((name, getattr(raw, name)) for name, *_ in raw._fields_)
    return {name: value.decode() if isinstance(value, bytes) else value for name, value in found}


def _var(v: RawVar) -> Var:
    row = _stated(v)
    follows = row["unit"].startswith("=")
    row |= {"unit": "1", "follows": row["unit"][1:]} if follows else {}
    return Var(**row | {"kind": KINDS[v.kind], "raw": v})


@functools.cache
def block_types() -> dict[str, BlockType]:
    """Return all types of blocks of the library by name."""
    table = (C.POINTER(_Block) * 1000).in_dll(library(), "hyst_blocks")
    types: dict[str, BlockType] = {}
    for pointer in itertools.takewhile(bool, table):
        b = pointer.contents
        row = _stated(b.told) | _stated(b)
        row |= {"rate": RATES[b.rate], "smooth": b.told.smooth or 1e-5, "hold": row["hold"] or "zoh", "raw": b}
        row["dims"] = tuple(Dim(**_stated(d)) for d in b.dims[: b.n_dims])
        row["vars"] = tuple(map(_var, b.vars[: b.n_vars]))
        types[row["name"]] = BlockType(**{f.name: row[f.name] for f in fields(BlockType)})
    return types
