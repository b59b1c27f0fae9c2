"""Calls of Model Exchange: time events, invalid times and states, non-finite inputs, states as variables."""

from __future__ import annotations

import ctypes as C
import math
from collections.abc import Callable

import numpy as np
import pytest
from fmu_events import Events, euler
from fmu_master import DISCARD, ERROR, OK, WARNING, H, loop, mixed, rows, single

from hystfmu.graph import Graph, Node

Make = Callable[..., Events]


def continuous() -> Graph:
    """Return a first-order lag: q' = (u - q) / T, y = 2 q, T = 5 ms."""
    return Graph.single(Node("g", "creep", {}, {"w": [2.0], "T": [5e-3]}))


# ---- time events ----
@pytest.mark.parametrize("t0", [0.0, -0.3, 1e6])
def test_time_events_come_at_the_sample_period(make: Make, t0: float) -> None:
    """At t0 + k h, without a drift; an importer may be late by some rounding, not early by a period."""
    m = make(single("delay"), "me")
    m.begin(np.array([0.0]), t0)
    for k in range(1, 400):
        assert m.next == t0 + k * H
        assert m.set_time(m.next * (1 + 1e-16 * (k % 3 - 1))) == OK
        m.event(np.array([0.1 * k]))
    assert m.set_time(m.next - 0.1 * H) == OK
    before = m.next
    m.event(np.array([0.0]))
    assert m.next == before, "an event before the sample time is not a sample"


def test_blocks_without_samples_have_no_time_events(make: Make) -> None:
    for graph in (single("prandtl_ishlinskii"), continuous(), single("reference")):
        m = make(graph, "me")
        m.begin(rows(graph, 1)[0])
        assert m.next is None


def test_skipped_samples_are_taken_late(make: Make) -> None:
    """The result equals Co-Simulation, where the input of the event was held since the last one."""
    graph = single("pid")
    u = rows(graph, 9)
    want = graph.executor().run(np.vstack([u[:1], np.repeat(u[1:], 3, axis=0)]), 1, H)[::3]
    m = make(graph, "me")
    got = [m.begin(u[0])]
    for k in range(1, len(u)):
        assert m.set_time(3 * k * H) == OK
        got.append(m.event(u[k]))
        assert m.next == pytest.approx((3 * k + 1) * H)
    assert np.array(got).tobytes() == want.tobytes()
    assert m.set_time(1e300) == OK
    assert m.call("EnterEventMode") == OK
    before = m.memory()
    assert m.update() == ERROR
    assert m.messages[-1][2] == "The time passed over more than 1e6 samples of the model."
    assert m.memory() == before


@pytest.mark.parametrize("t", [math.nan, math.inf, -math.inf])
def test_bad_time(make: Make, t: float) -> None:
    m = make(mixed(), "me")
    m.begin(np.array([0.1]))
    before = m.memory()
    assert m.set_time(t) == ERROR
    assert m.messages[-1][2] == "The time must be finite."
    assert m.memory() == before


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_states_without_finite_value(make: Make, bad: float) -> None:
    """A diverging solver is told to try a shorter step."""
    m = make(continuous(), "me")
    m.begin(np.array([0.5]))
    assert m.set_x(np.array([0.25])) == OK
    before = m.memory()
    assert m.set_x(np.array([bad])) == DISCARD
    word = "NaN" if math.isnan(bad) else "infinite"
    assert m.messages[-1] == (WARNING, "logStatusWarning", f"The continuous state 'q' is {word}: it is not set.")
    assert m.memory() == before
    assert m.set_x(np.array([-1e308])) == OK
    assert m.vector("GetDerivatives" if m.fmi == 2 else "GetContinuousStateDerivatives")[0] == DISCARD
    assert m.messages[-1][2] == "The derivative of 'q' is not finite at t = 0 s."
    assert m.set_x(np.array([0.25])) == OK
    assert m.derivatives()[0] == pytest.approx((0.5 - 0.25) / 5e-3)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_input_without_finite_value(make: Make, bad: float) -> None:
    """Derivatives, accepted steps and events wait for a finite input; the invalid input leaves no effect."""
    u = rows(mixed(), 30)
    want, m = make(mixed(), "me"), make(mixed(), "me")
    expected = want.integrate(u, H, euler(2))
    m.begin(u[0])
    before = m.memory()
    assert m.set("u", bad) == DISCARD
    assert m.vector("GetDerivatives" if m.fmi == 2 else "GetContinuousStateDerivatives")[0] == DISCARD
    assert m.completed() == DISCARD
    assert m.call("EnterEventMode") == OK
    assert m.update() == DISCARD
    m.leave()
    assert [x[0] for x in m.messages] == [WARNING], "one warning"
    m.put(u[0])
    m.outputs()
    assert m.memory() == before
    assert m.call("Reset") == OK
    m.next = None
    assert m.integrate(u, H, euler(2)).tobytes() == expected.tobytes()


def test_tunable_parameters_are_set_in_event_mode(make: Make) -> None:
    m = make(Graph.single(Node("c", "creep", {}, {"w": [1.0, 1.0], "T": [0.1, 0.2]})), "me")
    m.begin(np.array([1.0]))
    before = m.memory()
    assert m.set("w", 2.0, 2.0) == ERROR
    assert m.messages[-1][2] == "'w' is a parameter: set it in Event Mode."
    assert m.memory() == before
    assert m.set_x(np.array([0.1, 0.2])) == OK
    assert m.get("y") == pytest.approx(0.3)
    assert m.call("EnterEventMode") == OK
    assert m.set("w", 2.0, 2.0) == OK
    assert m.set("T", 0.01, 0.2) == OK
    assert m.get("y") == pytest.approx(0.6)
    assert m.update() == OK
    m.leave()
    np.testing.assert_allclose(m.derivatives(), [90.0, 4.0])


# ---- states and derivatives as variables ----------------------------------------------------------------------------
def scalar(m: Events, what: str, reference: int, value: float = 0.0) -> tuple[int, float]:
    buffer, one = (C.c_double * 1)(value), (C.c_uint * 1)(reference)
    extra = () if m.fmi == 2 else (C.c_size_t(1),)
    status = m.call(f"{what}{'Real' if m.fmi == 2 else 'Float64'}", one, C.c_size_t(1), buffer, *extra)
    return status, buffer[0]


@pytest.mark.parametrize("interface", ["me", "cs"])
def test_states_and_derivatives_are_variables(make: Make, interface: str) -> None:
    graph = continuous()
    m = make(graph, interface)
    first = sum(p.size for p in graph.ports) + 1  # after the time
    if interface == "me":
        m.begin(np.array([0.5]))
        assert scalar(m, "Set", first, 0.125) == (OK, 0.125)
        assert m.x[0] == 0.125
        assert m.derivatives()[0] == pytest.approx((0.5 - 0.125) / 5e-3)
        assert scalar(m, "Set", first, math.nan)[0] == DISCARD
    else:
        m.initialize()
        m.set("u", 0.5)
        assert m.step(0.0, 5e-3) == OK
        assert scalar(m, "Get", first)[1] == pytest.approx(0.5 * (1 - math.exp(-1)))
        assert scalar(m, "Set", first, 0.1)[0] == ERROR
    x = scalar(m, "Get", first)[1]
    assert scalar(m, "Get", first + 1)[1] == pytest.approx((0.5 - x) / 5e-3)
    assert m.get("y") == 2 * x
    before = m.memory()
    assert scalar(m, "Set", first + 1, 0.1)[0] == ERROR
    assert m.messages[-1][2] == "The derivative of 'q' cannot be set."
    assert scalar(m, "Get", first + 2)[0] == ERROR
    assert m.memory() == before


def test_events_between_samples_take_no_sample(make: Make) -> None:
    graph = loop()
    m, plain = make(graph, "me"), make(graph, "me")
    for k in (m, plain):
        k.begin(np.array([0.0]))
    assert m.set_time(0.5 * H) == OK
    y = m.event(np.array([0.25]))
    assert m.next == H
    assert y[1] == plain.outputs()[1], "the controller holds"
