"""Binding of the C core (ctypes): the shared library and its block tables.

Names and defaults of blocks come from the X-macro tables in `fmu_build/core/blocks`.
"""

from __future__ import annotations

import ctypes as C
import functools
import itertools
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from hystfmu.base import PACKAGE

KINDS = ("param", "fixed", "derived", "input", "time", "output", "cstate", "state")
RATES = ("function", "continuous", "hysteretic", "sampled")
STEP = 1
NO_LIMIT = 1e300  # parameters are finite, so this value means "no limit", as in limit.h

_D = C.POINTER(C.c_double)
_I = C.POINTER(C.c_int)


def _fields(text: str) -> list[tuple[str, Any]]:
    """Return the fields of a structure; each field is given by its name and the letter of its type."""
    kinds: dict[str, type] = {"s": C.c_char_p, "i": C.c_int, "h": C.c_ushort, "d": C.c_double, "p": C.c_void_p}
    return [(name, kinds[letter]) for name, _, letter in (word.partition(":") for word in text.split())]


class RawVar(C.Structure):
    """`hyst_var` of hyst.h."""

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
    """`hyst_error` of graph.h."""

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
    """One row of a block's table.

    Attributes
    ----------
    name, text : str
        Name and meaning.
    kind : str
        One of `KINDS`.
    size : str
        Number of elements, as a C expression of the sizes of the block.
    type : str
        ``real``, ``int``, ``bool``, or the words of an enumeration joined by ``|``.
    unit : str
        Unit of measure; "1" or empty if there is none.
    follows : str
        Input with the same unit of measure in a graph that states units of measure; "" if there is none.
    start, lo, hi : float
        Default and limits.
    raw : RawVar
        Row in the form of the core.
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
        """Valid values in words, e.g. ``"a float in [0, inf)"``."""
        text = C.create_string_buffer(160)
        library().hyst_interval(C.byref(self.raw), text, len(text))
        return text.value.decode()

    @property
    def choices(self) -> tuple[str, ...]:
        """Words of an enumeration in the order of their values; empty for other types."""
        return tuple(self.type.split("|")) if "|" in self.type else ()


@dataclass(frozen=True)
class Dim:
    """One size of a block: default and limits."""

    name: str
    start: int
    lo: int
    hi: int
    text: str


@dataclass(frozen=True)
class BlockType:
    """A block with the description in its C file; `hyst_told` and `hyst_rate` in hyst.h define the fields.

    Attributes
    ----------
    family : str
        Folder of its C file: operators, inverses, networks, dynamics, controllers, sources.
    rate : str
        Rate class in continuous time: function, continuous, hysteretic, sampled.
    inverts, invert_condition : str or None
        Block that this block inverts exactly (dead_zones and scaling invert themselves), and the condition.
    tolerance : str
        Tolerance class of its numerical error: rounding, iteration, integration.
    rule_error, rule_step : float
        For the tolerance class integration: relative error bound; step (s) without visible error, or 0.
    smooth : float
        Distance from a point within which the tangent at this point is valid.
    trial : int
        If `trial` is not 0, the graph searches the output so that input number `trial` (from 1) equals the first input.
    hold : str
        Hold of the inputs within a step, for blocks without a parameter `hold`: zoh, foh.
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
        """Name of the block that inverts this block exactly; for an inverse, name of the operator."""
        return next((b.name for b in block_types().values() if b.inverts == self.name), self.inverts)

    @property
    def inverse_condition(self) -> str | None:
        """Condition under which `inverse` is exact."""
        if self.inverts or self.inverse is None:
            return self.invert_condition
        return block_types()[self.inverse].invert_condition

    @property
    def tried(self) -> str | None:
        """Input that equals the first input after the search of the output; a wire into this input closes no loop."""
        return self.of("input")[self.trial - 1].name if self.trial else None

    @property
    def rate_independent(self) -> bool:
        """True if the output depends on the input path but not on time."""
        return self.rate in ("function", "hysteretic") and not self.of("time")

    @property
    def class_name(self) -> str:
        """Name in CamelCase, for Python classes, Modelica classes and FMUs."""
        return "".join(w.capitalize() for w in self.name.split("_"))

    def of(self, *kinds: str) -> tuple[Var, ...]:
        """Rows of these kinds, in the order of the table."""
        return tuple(v for v in self.vars if v.kind in kinds)

    @property
    def parameters(self) -> tuple[Var, ...]:
        """Tunable and fixed parameters."""
        return self.of("param", "fixed")

    def sizes(self, dims: Mapping[str, int]) -> dict[str, int]:
        """Return the number of elements of every variable for the sizes `dims`."""
        values = self.raw_dims(dims)
        return {v.name: int(self.raw.size(values, i)) for i, v in enumerate(self.vars)}

    def raw_dims(self, dims: Mapping[str, int]) -> C.Array[C.c_int]:
        """Return the sizes in the form of the C functions of the block."""
        return (C.c_int * (len(self.dims) + 1))(*[dims[d.name] for d in self.dims])  # + 1: a block may have no size


@functools.cache
def library() -> C.CDLL:
    """Load the compiled core and declare the argument types of the graph executor."""
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


def _var(v: RawVar) -> Var:
    unit = v.unit.decode()
    follows = unit.startswith("=")
    words = v.name.decode(), KINDS[v.kind], v.size.decode(), v.type.decode(), "1" if follows else unit
    return Var(*words, v.start, v.lo, v.hi, v.text.decode(), v, unit[1:] if follows else "")


@functools.cache
def block_types() -> dict[str, BlockType]:
    """Return all blocks of the library by name, with the description in their C tables."""
    table = (C.POINTER(_Block) * 1000).in_dll(library(), "hyst_blocks")
    types: dict[str, BlockType] = {}
    for pointer in itertools.takewhile(bool, table):
        b = pointer.contents
        told = b.told
        words: dict[str, Any] = {
            k: (getattr(told, k) or b"").decode() for k in ("text", "equation", "source", "family", "tolerance")
        }
        types[b.name.decode()] = BlockType(
            name=b.name.decode(),
            **words,
            rate=RATES[b.rate],
            inverts=told.inverts.decode() if told.inverts else None,
            invert_condition=told.invert_condition.decode() if told.invert_condition else None,
            rule_error=told.rule_error,
            rule_step=told.rule_step,
            smooth=told.smooth or 1e-5,
            hold=(told.hold or b"zoh").decode(),
            flags=b.flags,
            trial=b.trial,
            dims=tuple(Dim(d.name.decode(), d.start, d.lo, d.hi, d.text.decode()) for d in b.dims[: b.n_dims]),
            vars=tuple(map(_var, b.vars[: b.n_vars])),
            raw=b,
        )
    return types
