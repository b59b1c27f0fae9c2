"""What fails inside of the graph or of a list comes back as an error, changes nothing, and leaves nothing behind."""

from __future__ import annotations

import ctypes as C
import math
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmu_events import EventInfo, Events
from fmu_master import DISCARD, ERROR, OK, WARNING, H, Master, mixed, single

from hystfmu.graph import Graph, Input, Node, Output

Make = Callable[..., Any]
TOO_LONG = "the step is too long for "


def modes() -> Graph:
    return Graph.single(Node("m", "modes", {"n": 1}, {"f_n": [1e3], "zeta": [0.1]})).with_step(H)


def observer(step: float = 0.0) -> Graph:
    """Return a sampled block; without a sample time, each step of an importer is a sample."""
    return Graph.single(Node("o", "disturbance_observer", {}, {"f_n": 1e3})).with_step(step)


def pair() -> Graph:
    """Return a graph with a scalar input, a fixed parameter of another sort, and an input of two elements."""
    nodes = [Node("a", "backlash_sum", {"n": 1}), Node("s", "scaling", {"n": 2})]
    outputs = [Output("ya", "a.y"), Output("ys", "s.y")]
    return Graph(nodes, [], [Input("ua", ("a.u",)), Input("us", ("s.u",))], outputs).with_step(H)


# ---- steps and samples ----------------------------------------------------------------------------------------------
@pytest.mark.parametrize("graph", [modes, observer])
def test_a_step_that_a_block_refuses_is_an_error(make: Make, graph: Callable[[], Graph]) -> None:
    """The time, the inputs and the memory stay, and the next step is that of an instance which never tried."""
    m, plain = make(graph()), make(graph())
    name = next(p.name for p in m.graph.ports if p.kind == "input")
    for each in (m, plain):
        each.initialize()
        assert each.set(name, 0.5) == OK
        assert each.step(0.0) == OK
    assert m.step(H, 1e9) == ERROR
    assert TOO_LONG in m.messages.pop()[2]
    if m.fmi == 3:
        assert m.last_time.value == H
    for each in (m, plain):
        assert each.step(H) == OK
    got, want = ([each.get(p.name) for p in m.graph.ports if p.kind == "output"] for each in (m, plain))
    assert got == want
    assert m.memory() == plain.memory()


@pytest.mark.parametrize("fmi", [2], indirect=True)
def test_a_step_that_is_refused_puts_moving_inputs_back(make: Make) -> None:
    m = make(modes())
    m.initialize()
    assert m.set("u", 0.5) == OK
    u = C.byref(C.c_uint(m.ports["u"].reference))
    given = u, C.c_size_t(1), C.byref(C.c_int(1)), C.byref(C.c_double(2.0))
    assert m.call("SetRealInputDerivatives", *given) == OK
    assert m.step(0.0, 1e9) == ERROR
    assert TOO_LONG in m.messages.pop()[2]
    assert m.get("u") == 0.5


def test_a_sample_that_a_block_refuses_is_an_error(make: Make) -> None:
    m: Events = make(observer(H), "me")
    assert m.set("f_n", 1e14) == OK
    m.begin(np.zeros(2))
    assert m.set_time(H) == OK
    assert m.call("EnterEventMode") == OK
    for call in (m.update, lambda: m._access("Get", "u", None)[0]):
        m.messages.clear()
        assert call() == ERROR
        assert len(m.messages) == 1
        assert TOO_LONG in m.messages[0][2]


# ---- inputs without a value -----------------------------------------------------------------------------------------
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_step_waits_for_every_input(make: Make, bad: float) -> None:
    """Inputs that were mended may be set again and again: the others are still missing."""
    m = make(pair())
    m.initialize()
    assert m.set("us", bad, 1.0) == DISCARD
    assert m.set("ua", bad) == DISCARD
    assert m.set("ua", bad) == DISCARD
    assert [x[0] for x in m.messages] == [WARNING]
    for _ in range(3):
        assert m.set("ua", 0.5) == OK
        assert m.step(0.0) == DISCARD
    assert m.set("us", 1.0, bad) == DISCARD
    assert m.set("ua", 0.25) == OK
    assert m.step(0.0) == DISCARD
    for _ in range(2):
        assert m.set("us", 1.0, 2.0) == OK
    assert m.step(0.0) == OK
    assert [m.get("ua"), *m.get("us")] == [0.25, 1.0, 2.0]
    m.messages.clear()
    assert m.set("ua", bad) == DISCARD
    assert m.step(H) == DISCARD
    assert len(m.messages) == 1
    assert m.set("ua", 0.0) == OK
    assert m.step(H) == OK


# ---- lists ----------------------------------------------------------------------------------------------------------
UPDATE = C.CFUNCTYPE(None)(lambda: None)


def asked(m: Master, references: list[int]) -> Master:
    """Make an FMI 3.0 instance with intermediate updates for a list of references."""
    return m.another(references=references, update=UPDATE)


@pytest.mark.parametrize("fmi", [3], indirect=True)
def test_every_variable_with_intermediate_updates_is_a_real_input(make: Make) -> None:
    m = make(pair())
    a, s = m.ports["ua"].reference, m.ports["us"].reference
    others = [p.reference for p in m.graph.ports if p.kind != "input"]
    for good in ([], [a], [s], [a, s], [s, a, s]):
        made = asked(m, good)
        assert made.c.value
        made.free()
        for other in (*others, 10**6, 2**32 - 1):
            for at in range(len(good) + 1):
                wrong = asked(m, [*good[:at], other, *good[at:]])
                assert wrong.c.value is None
                said = "is no input of type Float64: only those have intermediate updates."
                assert [x[2] for x in wrong.messages] == [f"The variable with the value reference {other} {said}"]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads the size of the process")
@pytest.mark.parametrize("fmi", [3], indirect=True)
def test_an_instance_that_is_refused_for_its_list_leaves_no_memory(make: Make) -> None:
    graph = Graph.single(Node("net", "mlp", {"n_in": 1, "n_hidden": 3000}))
    m = make(graph)
    wrong = [m.ports["y"].reference]

    def size() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE")

    for _ in range(5):
        assert asked(m, wrong).c.value is None
    before, n = size(), 60
    for _ in range(n):
        assert asked(m, wrong).c.value is None
    assert size() - before < n * 3000 * 8, "the graph alone has more than 9000 values"


# ---- answers --------------------------------------------------------------------------------------------------------
def test_every_flag_is_written(make: Make, fmi: int) -> None:
    """Flags that an importer left at true, and times that it left at another value."""
    m: Events = make(mixed(), "me")
    m.initialize(2.0)
    if fmi == 2:
        info = EventInfo(*[1] * 4, 0, -1.0)
        assert m.call("NewDiscreteStates", C.byref(info)) == OK
        got = [info.new_states_needed, info.terminate, info.nominals_changed, info.values_changed]
        defined, at = info.next_defined, info.next
    else:
        flags, time = [C.c_bool(k < 4) for k in range(5)], C.c_double(-1.0)
        assert m.call("UpdateDiscreteStates", *map(C.byref, flags), C.byref(time)) == OK
        got, defined, at = [f.value for f in flags[:4]], flags[4].value, time.value
    assert [bool(x) for x in got] == [False] * 4
    assert (bool(defined), at) == (True, 2.0 + H)
    m.leave()
    assert m.completed() == OK


# ---- states ---------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("h", [H, 3 * H])
def test_a_restored_state_knows_the_length_of_its_last_step(make: Make, h: float) -> None:
    """What follows from a changed parameter is for steps of that length: with and without saving, the same."""
    m, plain = make(single("creep")), make(single("creep"))
    for each in (m, plain):
        each.initialize()
        assert each.set("u", 0.5) == OK
        assert each.step(0.0, h) == OK
    state = m.save()
    assert m.step(h, 7 * h) == OK
    assert m.restore(state) == OK
    assert m.memory() == plain.memory()
    places = [m.ports["y"].reference], [m.ports["u"].reference]
    for each in (m, plain):
        assert each.set("T", *[0.37] * m.ports["T"].size) == OK
        assert each.tangent(*places, np.ones(1), 1)[0] == OK
    assert m.memory() == plain.memory()


def test_every_state_has_a_derivative_in_initialization_mode(make: Make) -> None:
    """Lags that begin in steady state follow the input, each with its own slope; difference of two initialisations."""
    graph = Graph.single(Node("l", "creep", {"n": 3}, {"start": "steady"}))
    m: Events = make(graph, "me")
    assert m.enter() == OK
    first, u = sum(p.size for p in graph.ports) + 1, m.ports["u"].reference
    n = m.n_states
    places = [first + k for k in range(n)]
    status, slope = m.tangent(places, [u], np.ones(1), n)
    assert status == OK
    ends = []
    for value in (0.0, 1.0):
        assert m.set("u", value) == OK
        ends.append(m.x)
    np.testing.assert_allclose(slope, ends[1] - ends[0], rtol=1e-6, atol=1e-9)
    assert slope.tolist() == pytest.approx([1.0] * n, rel=1e-6)
