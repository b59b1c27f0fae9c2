"""Values: types, ranges, references, what may be set when; a refused call changes nothing."""

from __future__ import annotations

import ctypes as C
import math
from collections.abc import Callable

import numpy as np
import pytest
from fmu_master import ERROR, OK, H, Master, rows, single

Make = Callable[..., Master]
U = rows(single("prandtl_ishlinskii"))[:, 0]


def test_out_of_range(make: Make) -> None:
    m = make()
    before = m.memory()
    assert m.set("r", *[0.1] * 9, -1.0) == ERROR
    assert m.messages[-1] == (
        ERROR,
        "logStatusError",
        "The 'r' parameter of prandtl_ishlinskii must be a float in [0, inf). Got -1 instead.",
    )
    assert m.set("w", *[math.nan] * 10) == ERROR
    assert m.messages[-1][2].endswith("Got nan instead.")
    assert m.memory() == before, "none of the values is set when one is refused"


def test_types(make: Make) -> None:
    """Types are checked, and an enumeration has only its items as values."""
    m = make(single("reference"))
    last = len(m.ports["shape"].var.choices) - 1
    assert m.set("shape", last) == OK
    assert m.set("shape", last + 1) == ERROR
    assert m.set("shape", -1) == ERROR
    assert m.set("seed", 12) == OK
    assert m.enter() == OK
    assert (m.get("shape"), m.get("seed")) == (last, 12)
    name, ctype = ("GetReal", C.c_double) if m.fmi == 2 else ("GetInt32", C.c_int32)
    extra = () if m.fmi == 2 else (C.c_size_t(1),)
    assert m.call(name, (C.c_uint * 1)(m.ports["shape"].reference), C.c_size_t(1), (ctype * 1)(), *extra) == ERROR
    assert m.messages[-1][2] == f"fmi{m.fmi}{name}: 'shape' is of type enumeration."


def test_time_and_array_counts_in_fmi3(make: Make, fmi: int) -> None:
    if fmi == 2:
        pytest.skip("FMI 2.0 has neither arrays nor a variable for the time")
    m = make()
    m.initialize(t=2.0)
    m.step(2.0)
    reference = sum(p.size for p in m.graph.ports)
    value = (C.c_double * 11)()
    assert m.call("GetFloat64", (C.c_uint * 1)(reference), C.c_size_t(1), value, C.c_size_t(1)) == OK
    assert value[0] == 2.0 + H
    r = m.ports["r"].reference
    both = (C.c_uint * 2)(r, reference)
    assert m.call("GetFloat64", both, C.c_size_t(2), value, C.c_size_t(11)) == OK
    assert list(value) == [*m.graph.nodes[0].value("r"), 2.0 + H]
    assert m.call("GetFloat64", both, C.c_size_t(2), value, C.c_size_t(10)) == ERROR
    assert m.messages[-1][2] == "fmi3GetFloat64: the variables have 11 values. Got room for 10."
    assert m.call("GetFloat64", (C.c_uint * 1)(r + 1), C.c_size_t(1), value, C.c_size_t(1)) == ERROR
    assert m.call("SetFloat64", (C.c_uint * 1)(reference), C.c_size_t(1), value, C.c_size_t(1)) == ERROR


def test_outputs_cannot_be_set(make: Make) -> None:
    m = make()
    m.initialize()
    assert m.set("y", 1.0) == ERROR
    assert m.messages[-1][2] == "'y' is an output and cannot be set."


def test_fixed_and_tunable(make: Make) -> None:
    fixed = make()
    assert fixed.set("u0", 0.2) == OK
    assert fixed.enter() == OK
    assert fixed.set("u0", 0.3) == OK
    assert fixed.call("ExitInitializationMode") == OK
    before = fixed.memory()
    assert fixed.set("u0", 0.4) == ERROR
    assert fixed.memory() == before
    assert fixed.messages[-1][2] == "'u0' is a fixed parameter: set it before the initialisation ends."
    tunable = make(single("backlash_sum"))
    tunable.initialize()
    assert tunable.set("w0", 3.0) == OK
    assert tunable.set("u", 0.0) == OK
    assert tunable.step(0.0) == OK
    before_y = tunable.get("y")
    assert tunable.set("u", 1e-9) == OK
    assert tunable.step(H) == OK
    assert tunable.get("y") - before_y == pytest.approx(3e-9, rel=1e-6)


def test_parameters_that_do_not_fit_together(make: Make) -> None:
    """Each value is valid but their combination is not: the initialisation fails and can be repeated."""
    m = make()
    assert m.set("r", *np.linspace(0.9, 0.0, 10)) == OK
    assert m.enter() == OK
    assert m.call("ExitInitializationMode") == ERROR
    assert m.messages[-1][2].startswith("the parameters do not fit together at prandtl_ishlinskii: ")
    assert m.set("r", *np.linspace(0.0, 0.9, 10)) == OK
    assert m.call("ExitInitializationMode") == OK
