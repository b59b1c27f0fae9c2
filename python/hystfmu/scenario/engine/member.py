"""A unit of the master in C: structure of the unit, variables of its ports, and first-order hold of its inputs.

The first-order hold is a straight line through the last two values of a source. If the source precedes the unit with
the hold in the order, the line interpolates. If the source follows this unit, the line extrapolates.
"""

import ctypes as C
from collections.abc import Sequence
from typing import Any

import numpy as np

from hystfmu.graph.node import Port
from hystfmu.scenario.system.foreign import ForeignPort
from hystfmu.scenario.system.system import Link, Rows, System

GRAPH, FMI2, FMI3 = 0, 1, 2  # as in system.h


def fields(declared: str) -> tuple[tuple[str, Any], ...]:
    """Return the fields of a structure, declared as in C: a type and its fields, then ``;`` and the next type."""
    types = {"pointer": C.c_void_p, "int32": C.c_int32, "int64": C.c_int64, "double": C.c_double}
    groups = (group.split() for group in declared.split(";"))
    return tuple((name, types[kind]) for kind, *names in groups for name in names)


class Unit(C.Structure):
    """`master_unit` of system.h."""

    _fields_ = fields(
        "int32 kind rollback; int64 any_step period substeps; double h; pointer self set step get save "
        "restore tangent; int64 n_in n_out first; pointer source u vr_in vr_out; int64 n_vr_in n_vr_out; "
        "pointer ahead line at saved state seeds; double t"
    )


def unit_of(
    system: System, k: int, values: C.Array[C.c_double], source: Rows, links: Sequence[Link | None], **more: Any
) -> tuple[Unit, list[Any]]:
    """Return the structure of unit k for C, and arrays that must exist during the run.

    Parameters
    ----------
    system : System
    k : int
        Index of the unit in the order, or of the first of several units that are one graph.
    values : array of C
        Present values of the system. The lines of a first-order hold start with these values.
    source : array of int, shape (n,)
        Index of the value that each input reads; -1 for a constant.
    links : sequence of Link or None
        Connection of each input; None for a constant.
    **more
        Further fields of the structure.
    """
    part = system.parts[k]
    facts = {"any_step": part.any_step, "period": part.period, "substeps": part.substeps, "first": part.first}
    h = system.length(part) / part.substeps
    unit = Unit(h=h, n_in=len(source), source=source.ctypes.data, **facts, **more)
    if part.hold == "zero":
        return unit, [source]
    now = [values[j] if j >= 0 else 0.0 for j in source.tolist()]
    line, ahead = np.array(5 * now), np.array([0.0 if link is None else weight(system, link) for link in links])
    unit.ahead, unit.line = ahead.ctypes.data, line.ctypes.data
    return unit, [source, line, ahead]


def weight(system: System, link: Link) -> float:
    """Return the time of the newest value of a source within the step of the connected unit.

    The time is a fraction of the step: 0 is the start of the step, and 1 is the end.

    If the source follows the connected unit in the order, the value is older than the end of the step by one step of
    the source.
    """
    late = system.maker(link).period / system.parts[link.to].period
    return 1.0 if system.fresh(link) else 1.0 - late


Slot = tuple[str, tuple[str, ...]]


def slots(port: Port | ForeignPort, fmi: int) -> list[Slot]:
    """Return the name and the names of the elements of each variable that a port needs in an FMU of version `fmi`."""
    return [(port.name, port.scalar_names)] if fmi == 3 else [(n, (n,)) for n in port.scalar_names]
