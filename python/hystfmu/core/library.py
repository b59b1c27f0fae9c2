"""Binding of the C core (ctypes): the shared library and its block tables.

Names and defaults of blocks are not repeated here: they come from the X-macro tables in `fmu_build/core/blocks`.
"""

from __future__ import annotations

import ctypes as C
import functools
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field

from hystfmu.base import PACKAGE

KINDS = ("param", "fixed", "derived", "input", "time", "output", "cstate", "state")
RATES = ("function", "continuous", "hysteretic", "sampled")
STEP = 1
NO_LIMIT = 1e300  # parameters are finite, so this value means "no limit", as in limit.h

_D = C.POINTER(C.c_double)
_I = C.POINTER(C.c_int)


class RawVar(C.Structure):
    """`hyst_var` of hyst.h."""

    _fields_ = [
        ("name", C.c_char_p),
        ("kind", C.c_int),
        ("type", C.c_char_p),
        ("start", C.c_double),
        ("lo", C.c_double),
        ("hi", C.c_double),
        ("size", C.c_char_p),
        ("unit", C.c_char_p),
        ("text", C.c_char_p),
    ]


class _Dim(C.Structure):
    _fields_ = [
        ("name", C.c_char_p),
        ("start", C.c_int),
        ("lo", C.c_int),
        ("hi", C.c_int),
        ("text", C.c_char_p),
    ]


class _Told(C.Structure):
    _fields_ = [
        ("text", C.c_char_p),
        ("equation", C.c_char_p),
        ("source", C.c_char_p),
        ("family", C.c_char_p),
        ("inverts", C.c_char_p),
        ("invert_condition", C.c_char_p),
        ("tolerance", C.c_char_p),
        ("hold", C.c_char_p),
        ("rule_error", C.c_double),
        ("rule_step", C.c_double),
        ("smooth", C.c_double),
        ("sensitivity", C.c_void_p),
        ("derives", C.c_int),
        ("differences", C.c_char_p),
    ]


_OUTPUT = C.CFUNCTYPE(None, _I, _D, _D, _D, _D)


class _Block(C.Structure):
    _fields_ = [
        ("name", C.c_char_p),
        ("flags", C.c_ushort),
        ("trial", C.c_ushort),
        ("n_dims", C.c_int),
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
        Number of elements, as the C expression over the block's sizes.
    type : str
        ``real``, ``int``, ``bool``, or the words of an enumeration joined by ``|``.
    unit : str
        Unit of measure; "1" or empty without one.
    follows : str
        Input with the same unit of measure in a graph that states one; "" for none.
    start, lo, hi : float
        Default and limits.
    raw : RawVar
        The row as the core takes it.
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
    """A block as its C file describes it; `hyst_told` and `hyst_rate` in hyst.h define the fields.

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
        Distance from a point within which its tangent holds.
    trial : int
        If not 0, the graph searches the output so that input number `trial` (from 1) equals the first input.
    hold : str
        Hold of the inputs within a step, for blocks without a parameter of that name: zoh, foh.
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
        """Name of the block that inverts it exactly; of an inverse, the operator."""
        return next((b.name for b in block_types().values() if b.inverts == self.name), self.inverts)

    @property
    def inverse_condition(self) -> str | None:
        """Condition under which `inverse` is exact."""
        if self.inverts or self.inverse is None:
            return self.invert_condition
        return block_types()[self.inverse].invert_condition

    @property
    def tried(self) -> str | None:
        """Input that equals the first input after the search of the output: a wire into it does not close a loop."""
        return self.of("input")[self.trial - 1].name if self.trial else None

    @property
    def rate_independent(self) -> bool:
        """True if the output depends on the input path but not on time."""
        return self.rate in ("function", "hysteretic") and not self.of("time")

    @property
    def class_name(self) -> str:
        """The name in CamelCase, as Python classes, Modelica classes and FMUs use it."""
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
        """Return the sizes as the C functions of the block take them."""
        return (C.c_int * (len(self.dims) + 1))(*[dims[d.name] for d in self.dims])  # + 1: a block may have no size


def _library() -> C.CDLL:
    suffix = {"win32": "dll", "darwin": "dylib"}.get(sys.platform, "so")
    path = PACKAGE / f"_core.{suffix}"
    if not path.exists():
        raise ImportError(f"the compiled core {path.name} is missing: install the package with 'pip install .'")
    return C.CDLL(str(path))


@functools.cache
def library() -> C.CDLL:
    """Load the compiled core and declare the argument types of the graph executor."""
    lib = _library()
    lib.hyst_graph_measure.argtypes = [C.c_char_p, C.c_size_t, C.POINTER(C.c_size_t), C.POINTER(RawError)]
    lib.hyst_graph_open.argtypes = [
        C.c_char_p,
        C.c_size_t,
        C.c_void_p,
        C.c_size_t,
        C.POINTER(C.c_void_p),
        C.POINTER(RawError),
    ]
    lib.hyst_message.argtypes = [C.POINTER(RawError), C.c_char_p, C.c_size_t]
    lib.hyst_interval.argtypes = [C.POINTER(RawVar), C.c_char_p, C.c_size_t]
    lib.hyst_interval.restype = None
    lib.hyst_graph_error.argtypes = [C.c_void_p]
    lib.hyst_graph_error.restype = C.POINTER(RawError)
    lib.hyst_graph_defaults.argtypes = [C.c_void_p]
    lib.hyst_graph_defaults.restype = None
    lib.hyst_graph_start.argtypes = [C.c_void_p, C.c_double]
    lib.hyst_graph_step.argtypes = [C.c_void_p, C.c_double, C.c_double]
    lib.hyst_graph_end_of_step.argtypes = [C.c_void_p, C.c_double, C.c_double, C.c_double]
    lib.hyst_graph_end_of_step.restype = C.c_double
    lib.hyst_graph_run.argtypes = [C.c_void_p, C.c_int64, C.c_double, C.c_double, C.c_void_p, C.c_void_p]
    lib.hyst_graph_value.argtypes = [C.c_void_p, C.c_int64]
    lib.hyst_graph_value.restype = _D
    lib.hyst_graph_set.argtypes = [C.c_void_p, C.c_int64, C.c_double]
    lib.hyst_graph_state.argtypes = [C.c_void_p, C.POINTER(C.c_int64)]
    lib.hyst_graph_state.restype = _D
    lib.hyst_graph_n_continuous.argtypes = [C.c_void_p]
    lib.hyst_graph_n_continuous.restype = C.c_int64
    lib.hyst_graph_tangent_between.argtypes = [C.c_void_p, C.c_double, *[C.c_void_p] * 5]
    lib.hyst_graph_tangent_between.restype = None
    lib.hyst_sensitivity_measure.argtypes = [C.c_void_p, C.c_void_p]
    lib.hyst_sensitivity_measure.restype = C.c_size_t
    lib.hyst_sensitivity_run.argtypes = [C.c_void_p, C.c_int64, C.c_double, C.c_double, *[C.c_void_p] * 3]
    lib.hyst_columns_run.argtypes = [C.c_void_p, C.c_int64, C.c_void_p, C.c_int64, *[C.c_void_p] * 3]
    lib.hyst_columns_run.restype = None
    return lib


@functools.cache
def block_types() -> dict[str, BlockType]:
    """Return every block of the library by name, as its C table describes it."""
    lib = library()
    table = (C.POINTER(_Block) * 1000).in_dll(lib, "hyst_blocks")
    types: dict[str, BlockType] = {}
    for pointer in table:
        if not pointer:
            break
        b = pointer.contents
        dims = tuple(Dim(d.name.decode(), d.start, d.lo, d.hi, d.text.decode()) for d in b.dims[: b.n_dims])
        rows = tuple(
            Var(
                v.name.decode(),
                KINDS[v.kind],
                v.size.decode(),
                v.type.decode(),
                "1" if v.unit.startswith(b"=") else v.unit.decode(),
                v.start,
                v.lo,
                v.hi,
                v.text.decode(),
                v,
                v.unit.decode()[1:] if v.unit.startswith(b"=") else "",
            )
            for v in b.vars[: b.n_vars]
        )
        name = b.name.decode()
        told = b.told
        types[name] = BlockType(
            name=name,
            text=told.text.decode(),
            equation=told.equation.decode(),
            source=told.source.decode(),
            family=(told.family or b"").decode(),
            rate=RATES[b.rate],
            inverts=told.inverts.decode() if told.inverts else None,
            invert_condition=told.invert_condition.decode() if told.invert_condition else None,
            tolerance=(told.tolerance or b"").decode(),
            rule_error=told.rule_error,
            rule_step=told.rule_step,
            smooth=told.smooth or 1e-5,
            hold=(told.hold or b"zoh").decode(),
            flags=b.flags,
            trial=b.trial,
            dims=dims,
            vars=rows,
            raw=b,
        )
    return types
