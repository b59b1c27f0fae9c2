"""Values: types, ranges, references, NULL pointers; a refused call changes nothing."""

import ctypes as C
import math
from typing import Any

import numpy as np
import pytest
from fmu_events import Events
from fmu_master import DISCARD, ERROR, OK, H, Make, Master, mixed, single


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


# ---- NULL pointers of an importer: missing values are refused by name, results may be ignored ------------------------
NONE, ONE, ZERO = None, C.c_size_t(1), C.c_size_t(0)


def _refs(*references: int) -> Any:
    return (C.c_uint * len(references))(*references)


def _doubles(n: int = 1) -> Any:
    return (C.c_double * n)()


VALUES = ["GetReal", "GetInteger", "GetBoolean", "SetReal", "SetInteger", "SetBoolean"]
ARRAYS = ["GetFloat64", "GetInt32", "GetInt64", "GetBoolean", "SetFloat64", "SetInt32", "SetInt64", "SetBoolean"]
# function, arguments with one NULL, what it would have pointed to
IN_STEP_MODE: dict[int, list[tuple[str, tuple[Any, ...], str]]] = {
    2: [
        *((name, (NONE, ONE, _doubles()), "value references") for name in [*VALUES, "GetString", "SetString"]),
        *((name, (_refs(0), ONE, NONE), "values") for name in VALUES),
        ("SetDebugLogging", (1, ONE, NONE), "log categories"),
        ("SetRealInputDerivatives", (NONE, ONE, (C.c_int * 1)(1), _doubles()), "value references"),
        ("SetRealInputDerivatives", (_refs(0), ONE, NONE, _doubles()), "orders"),
        ("SetRealInputDerivatives", (_refs(0), ONE, (C.c_int * 1)(1), NONE), "values"),
        ("GetDirectionalDerivative", (NONE, ONE, _refs(0), ONE, _doubles(), _doubles()), "unknowns"),
        ("GetDirectionalDerivative", (_refs(1), ONE, NONE, ONE, _doubles(), _doubles()), "knowns"),
        ("GetDirectionalDerivative", (_refs(1), ONE, _refs(0), ONE, NONE, _doubles()), "seeds"),
        ("GetDirectionalDerivative", (_refs(1), ONE, _refs(0), ONE, _doubles(), NONE), "sensitivities"),
        ("GetRealStatus", (2, NONE), "value"),
        ("GetBooleanStatus", (3, NONE), "value"),
    ],
    3: [
        *((name, (NONE, ONE, _doubles(), ONE), "value references") for name in ARRAYS),
        *((name, (_refs(0), ONE, NONE, ONE), "values") for name in ARRAYS),
        ("SetDebugLogging", (1, ONE, NONE), "log categories"),
        *(
            item
            for name in ("GetDirectionalDerivative", "GetAdjointDerivative")
            for item in [
                (name, (NONE, ONE, _refs(0), ONE, _doubles(), ONE, _doubles(), ONE), "unknowns"),
                (name, (_refs(1), ONE, NONE, ONE, _doubles(), ONE, _doubles(), ONE), "knowns"),
                (name, (_refs(1), ONE, _refs(0), ONE, NONE, ONE, _doubles(), ONE), "seeds"),
                (name, (_refs(1), ONE, _refs(0), ONE, _doubles(), ONE, NONE, ONE), "sensitivities"),
            ]
        ),
    ],
}


def test_a_missing_array_is_named(make: Make, fmi: int) -> None:
    m: Master = make()
    m.initialize()
    before = m.memory()
    for name, arguments, values in IN_STEP_MODE[fmi]:
        m.messages.clear()
        assert m.call(name, *arguments) == ERROR, name
        said = f"fmi{fmi}{name}: the pointer to the {values} is NULL."
        assert m.messages == [(ERROR, "logStatusError", said)]
    assert m.memory() == before


def test_a_missing_array_of_no_elements_is_none(make: Make, fmi: int) -> None:
    m: Master = make()
    m.initialize()
    rest = () if fmi == 2 else (ZERO,)
    for name in VALUES if fmi == 2 else ARRAYS:
        assert m.call(name, NONE, ZERO, NONE, *rest) == OK
    if fmi == 2:
        assert m.call("SetRealInputDerivatives", NONE, ZERO, NONE, NONE) == OK
        assert m.call("GetString", NONE, ZERO, NONE) == m.call("SetString", NONE, ZERO, NONE) == OK
    assert m.messages == []


def test_missing_places_of_states(make: Make, fmi: int) -> None:
    m: Master = make()
    state = m.save()
    get, serialize, size = (m._state(n) for n in ("GetFMUState", "SerializeFMUState", "SerializedFMUStateSize"))
    nowhere = "No place for the FMU state was given."
    n, content = C.c_size_t(), m.memory()
    assert m.call(size, state, C.byref(n)) == OK
    for name, arguments, said in [
        (get, (NONE,), nowhere),
        (m._state("DeserializeFMUState"), (content, C.c_size_t(len(content)), NONE), nowhere),
        (size, (state, NONE), f"fmi{fmi}{size}: the pointer to the size is NULL."),
        (serialize, (state, NONE, n), f"The serialized state needs {n.value} bytes. Got room for {n.value}."),
    ]:
        assert m.call(name, *arguments) == ERROR
        assert m.messages.pop() == (ERROR, "logStatusError", said)
    room = C.create_string_buffer(n.value)
    assert m.call(serialize, state, room, C.c_size_t(n.value - 1)) == ERROR
    assert m.messages.pop()[2].endswith(f"needs {n.value} bytes. Got room for {n.value - 1}.")
    assert m.call(serialize, state, room, n) == OK
    assert m.call(m._state("FreeFMUState"), NONE) == OK


def test_model_exchange_names_its_arrays_and_counts(make: Make, fmi: int) -> None:
    m: Events = make(mixed(), "me")
    m.initialize()
    assert m.update() == OK
    m.leave()
    rates = "GetDerivatives" if fmi == 2 else "GetContinuousStateDerivatives"
    for name, values in [
        ("SetContinuousStates", "continuous states"),
        ("GetContinuousStates", "continuous states"),
        (rates, "derivatives"),
        ("GetNominalsOfContinuousStates", "nominal values"),
    ]:
        assert m.call(name, NONE, C.c_size_t(2)) == ERROR
        assert m.messages.pop()[2] == f"fmi{fmi}{name}: the pointer to the {values} is NULL."
        for n in (0, 1, 3):
            assert m.call(name, _doubles(n), C.c_size_t(n)) == ERROR
            assert m.messages.pop()[2] == f"fmi{fmi}{name}: the unit has 2 of them. Got room for {n}."
    assert m.call("GetEventIndicators", NONE, ONE) == ERROR
    assert m.messages.pop()[2] == f"fmi{fmi}GetEventIndicators: the unit has 0 of them. Got room for 1."
    nominals = _doubles(2)
    assert m.call("GetNominalsOfContinuousStates", nominals, C.c_size_t(2)) == OK
    assert list(nominals) == [1.0, 1.0]
    if fmi == 3:
        for name, count in [("GetNumberOfEventIndicators", 0), ("GetNumberOfContinuousStates", 2)]:
            n = C.c_size_t(9)
            assert m.call(name, C.byref(n)) == OK
            assert n.value == count
            assert m.call(name, NONE) == ERROR
            assert m.messages.pop()[2] == f"fmi3{name}: the pointer to the number is NULL."


def test_answers_that_an_importer_ignores(make: Make, fmi: int) -> None:
    m: Events = make(mixed(), "me")
    m.initialize()
    assert m.call(*(["NewDiscreteStates", NONE] if fmi == 2 else ["UpdateDiscreteStates", *[NONE] * 6])) == OK
    m.leave()
    assert m.call("CompletedIntegratorStep", 1, NONE, NONE) == OK
    if fmi == 3:
        stepped: Master = make()
        stepped.initialize()
        assert stepped.call("DoStep", C.c_double(0), C.c_double(H), C.c_bool(True), *[NONE] * 4) == OK
        flags = [C.c_bool(True) for _ in range(3)]
        reached = C.c_double()
        status = stepped.call(
            "DoStep", C.c_double(H), C.c_double(H), C.c_bool(True), *map(C.byref, flags), C.byref(reached)
        )
        assert (status, [f.value for f in flags], reached.value) == (OK, [False] * 3, 2 * H)


@pytest.mark.parametrize("fmi", [2], indirect=True)
def test_status_of_fmi_2(make: Make) -> None:
    """Kinds 0 to 3: fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated."""
    m: Master = make()
    m.initialize()
    assert m.step(0.0) == OK
    for name, value, mine, answer in [("GetRealStatus", C.c_double(-1), 2, H), ("GetBooleanStatus", C.c_int(-1), 3, 0)]:
        for kind in {0, 1, 2, 3} - {mine}:
            assert m.call(name, kind, C.byref(value)) == DISCARD
            assert value.value == -1
        assert m.call(name, mine, C.byref(value)) == OK
        assert value.value == answer


@pytest.mark.parametrize("fmi", [2], indirect=True)
def test_there_are_no_texts(make: Make) -> None:
    m: Master = make()
    m.initialize()
    text = (C.c_char_p * 1)(b"x")
    for name in ("GetString", "SetString"):
        assert m.call(name, _refs(0), ONE, text) == ERROR
        assert m.messages.pop()[2] == f"fmi2{name}: 'u' is of type real."
        assert m.call(name, _refs(10**6), ONE, text) == ERROR
        assert m.messages.pop()[2] == f"fmi2{name}: no variable has the value reference 1000000."


def test_a_call_sets_all_values_or_none(make: Make, fmi: int) -> None:
    """The second value is refused, or the second variable is none that can be set: the first one stays as it was."""
    m: Master = make(single("backlash_sum"))
    m.initialize()
    before = m.memory()
    u, y, r = (m.ports[n].reference for n in ("u", "y", "r"))
    name, rest = ("SetReal", ()) if fmi == 2 else ("SetFloat64", (C.c_size_t(2),))
    for second, value in [(y, 1.0), (r, -1.0), (10**6, 0.0)]:
        size = m.ports["r"].size if fmi == 3 and second == r else 1
        given = (C.c_double * (1 + size))(0.5, *[value] * size)
        count = () if fmi == 2 else (C.c_size_t(1 + size),)
        assert m.call(name, _refs(u, second), C.c_size_t(2), given, *count) == ERROR
        assert m.memory() == before
    assert m.call(name, _refs(u, u), C.c_size_t(2), (C.c_double * 2)(0.5, 0.25), *rest) == OK
    assert m.get("u") == 0.25
    if fmi == 3:
        assert m.call(name, _refs(u, u), C.c_size_t(2), _doubles(3), C.c_size_t(3)) == ERROR
        assert m.messages[-1][2] == "fmi3SetFloat64: the variables have 2 values. Got room for 3."
