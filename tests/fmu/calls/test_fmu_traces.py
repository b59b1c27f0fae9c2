"""What a call may not leave behind: trials of events, derivatives, states that are gone; what it must not forget."""

from __future__ import annotations

import ctypes as C
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from fmu_events import Events
from fmu_master import ERROR, OK, H, Master, mixed, single

from hystfmu.graph import Graph, Node
from hystfmu.unit import Unit

Make = Callable[..., Any]
GONE = "The FMU state was freed or does not belong to this instance."


def due(make: Make) -> Events:
    """Model Exchange in Event Mode at the time of a sample, after a step with other inputs."""
    m: Events = make(mixed(), "me")
    m.begin(np.array([0.3]))
    assert m.set_time(H) == OK
    assert m.set("u", 0.8) == OK
    assert m.set_x(np.array([0.01, 2.0])) == OK
    assert m.completed(asks=True) == OK
    assert m.call("EnterEventMode") == OK
    return m


def test_derivatives_leave_no_trace(make: Make) -> None:
    """In every mode; in Event Mode they are differences of trials, from states and inputs that must come back."""
    m = due(make)
    y, u = m.ports["y"].reference, m.ports["u"].reference
    x = sum(p.size for p in m.graph.ports) + 1
    before, outputs = m.memory(), m.outputs()
    for known in (u, x, x + 1):
        assert m.tangent([y], [known], np.array([-2.0]), 1)[0] == OK
        assert m.memory() == before
        assert m.tangent([y], [known], np.array([3.0]), 1)[0] == OK
        assert m.outputs() == outputs
    assert m.memory() == before
    assert m.update() == OK
    m.leave()
    after, seen = m.memory(), m.outputs()
    assert m.tangent([y], [x], np.ones(1), 1)[0] == OK
    assert (m.memory(), m.outputs()) == (after, seen)


@pytest.mark.parametrize(
    ("at", "slopes"), [(-2.0, (1.0, 0.0)), (3.0, (0.0, -1.0)), (-64.0, (0.0, 0.0)), (0.5, (1.0, -1.0))]
)
def test_differences_stay_on_the_side_of_the_seed(make: Make, at: float, slopes: tuple[float, float]) -> None:
    """y = max(-2, min(3, u)) in Initialization Mode, with seeds of either sign and any size."""
    graph = Graph.single(Node("s", "scaling", {"n": 1}, {"lo": -2.0, "hi": 3.0})).with_step(H)
    m = make(graph)
    assert m.enter() == OK
    assert m.set("u", at) == OK
    places = [m.ports["y"].reference], [m.ports["u"].reference]
    for size in (1.0, 1e-3, 1e4):
        for sign, slope in zip((1, -1), slopes, strict=True):
            status, found = m.tangent(*places, np.array([sign * size]), 1)
            assert status == OK
            assert found[0] == pytest.approx(slope * size, abs=1e-6 * size)
    assert m.get("u") == at


@pytest.mark.parametrize("fmi", [2], indirect=True)
def test_a_time_before_the_sample_takes_the_trial_back(make: Make) -> None:
    """FMI 2.0 lets an importer set the time in Event Mode: what was tried at the later time must not stay."""
    tried, other = due(make), due(make)
    tried.outputs()
    for m in (tried, other):
        assert m.set_time(0.5 * H) == OK
    assert tried.outputs() == other.outputs()
    assert tried.memory() == other.memory()


def test_a_restored_state_is_no_trial(make: Make) -> None:
    m: Events = make(mixed(), "me")
    m.begin(np.array([0.3]))
    state, content = m.save(), m.memory()
    assert m.set_time(H) == OK
    assert m.set("u", 0.8) == OK
    assert m.completed(asks=True) == OK
    assert m.call("EnterEventMode") == OK
    m.outputs()
    assert m.restore(state) == OK
    assert m.memory() == content


def test_a_state_that_is_gone_is_refused_by_every_call(make: Make) -> None:
    m: Master = make()
    state = m.save()
    n = len(m.serialize(state))
    assert m.forget(state) == OK
    room = C.create_string_buffer(n)
    for name, arguments in [
        ("SetFMUState", (state,)),
        ("FreeFMUState", (C.byref(C.c_void_p(state.value)),)),
        ("GetFMUState", (C.byref(C.c_void_p(state.value)),)),
        ("SerializedFMUStateSize", (state, C.byref(C.c_size_t()))),
        ("SerializeFMUState", (state, room, C.c_size_t(n))),
        ("DeserializeFMUState", (m.memory(), C.c_size_t(n), C.byref(C.c_void_p(state.value)))),
    ]:
        m.messages.clear()
        assert m.call(m._state(name), *arguments) == ERROR, name
        assert m.messages == [(ERROR, "logStatusError", GONE)]
    assert m.forget(C.c_void_p(None)) == OK, "the standards: a null pointer is ignored"


def test_states_are_freed_in_any_order(make: Make) -> None:
    m: Master = make()
    m.initialize()
    states = [m.save() for _ in range(5)]
    for k in (2, 4, 0, 3, 1):
        assert m.forget(states[k]) == OK
        left = [s for s in states[:k] if m.restore(s) == OK]
        assert len(left) == len([j for j in range(k) if (2, 4, 0, 3, 1).index(j) > (2, 4, 0, 3, 1).index(k)])


def test_references_beyond_the_derivatives_are_unknown(make: Make, fmi: int) -> None:
    m: Events = make(mixed(), "me")
    m.begin(np.array([0.3]))
    first, name = sum(p.size for p in m.graph.ports) + 1, "GetReal" if fmi == 2 else "GetFloat64"
    rest = () if fmi == 2 else (C.c_size_t(1),)

    def get(reference: int) -> int:
        return m.call(name, (C.c_uint * 1)(reference), C.c_size_t(1), (C.c_double * 1)(), *rest)

    assert [get(first + k) for k in range(4)] == [OK] * 4
    for reference in (first + 4, first + 5, first + 6, 2**32 - 1):
        assert get(reference) == ERROR
        assert m.messages.pop()[2] == f"fmi{fmi}{name}: no variable has the value reference {reference}."
    assert get(first - 1) == (OK if fmi == 3 else ERROR), "the time is a variable of FMI 3.0 alone"


def test_the_clock_may_be_off_by_sixteen_units_in_the_last_place(make: Make) -> None:
    t0, h = 2.0**20, 2.0**-20  # a thousandth of the step is far below
    unit = 2.0**-32
    for sign in (1, -1):
        m: Master = make()
        m.initialize(t0)
        allowed = 16 * unit + 1e-3 * h
        for off, good in [(allowed - unit, True), (allowed + unit, False)]:
            state = m.save()
            assert m.step(t0 + sign * (off // unit) * unit, h) == (OK if good else ERROR), off
            assert m.restore(state) == OK


@pytest.mark.parametrize(
    ("block", "name", "value"),
    [
        ("creep", "T", 0.37),
        ("transfer_function", "b", 2.5),
        ("lead_lag", "T_p", 0.011),
        ("pid", "Ki", 71.0),
        ("disturbance_observer", "f_n", 37.0),
        ("sliding_mode", "eta", 0.07),
    ],
)
def test_a_parameter_acts_from_the_next_step_with_all_that_follows_from_it(
    make: Make, block: str, name: str, value: float
) -> None:
    graph = single(block)
    port = next(p for p in graph.ports if p.name == name)
    kind = port.kind
    m, unit = make(graph), Unit(graph)
    inputs = [p.name for p in graph.ports if p.kind == "input"]
    outputs = [p.name for p in graph.ports if p.kind == "output"]
    late = kind == "param"
    new = [value * (1 + k) for k in range(port.size)]
    if not late:
        assert m.set(name, *new) == OK
        unit.set(name, new if port.size > 1 else new[0])
    m.initialize()
    unit.initialize(0.0)
    rng, moved = np.random.default_rng(1), set()
    for k in range(8):
        if late and k == 4:
            assert m.set(name, *new) == OK
            unit.set(name, new if port.size > 1 else new[0])
        for i in inputs:
            v = rng.normal(size=next(p.size for p in graph.ports if p.name == i))
            assert m.set(i, *v) == OK
            unit.set(i, v.tolist() if len(v) > 1 else float(v[0]))
        assert m.step(k * H) == OK
        unit.do_step(k * H, H)
        got = [m.get(o) for o in outputs]
        assert got == [unit.get(o) if np.ndim(unit.get(o)) == 0 else list(unit.get(o)) for o in outputs]
        moved.add(str(got))
    assert len(moved) == 8
