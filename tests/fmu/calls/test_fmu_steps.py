"""Times and lengths of steps, inputs without a value, blocks that refuse: a refused step changes nothing."""

import ctypes as C
import math
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fmu_events import EventInfo, Events
from fmu_master import DISCARD, ERROR, OK, WARNING, H, Make, Master, U, mixed, single

from hystfmu import Graph, Input, InputError, Node, Output, Unit


@pytest.mark.parametrize(
    "h", [0.0, -0.0, -5.7e-15, -1e-3, math.nan, math.inf, -math.inf, math.nextafter(1e9, math.inf), 1e300]
)
def test_bad_step_size(make: Make, h: float) -> None:
    m = make()
    m.initialize()
    m.run(U[:5])
    before = m.memory()
    assert m.step(5 * H, h) == ERROR
    assert m.memory() == before
    assert m.messages[-1][2].startswith("The step size must be in (0, 1e9] s. Got ")
    assert m.step(5 * H, 1e9) == OK


@pytest.mark.parametrize("name", ["bouc_wen_oscillator", "maxwell_slip_oscillator", "duhem_oscillator"])
def test_a_step_that_a_block_refuses_changes_nothing(make: Make, name: str) -> None:
    """Also not the step for which the block derives its values, or the next derivative would be refused too."""
    m = make(single(name))
    m.initialize()
    m.run(U[:5])
    before = m.memory()
    assert m.step(5 * H, 1e8) == ERROR
    assert "the step is too long" in m.messages[-1][2]
    assert m.memory() == before
    m.messages.clear()
    u, y = m.graph.port("u").reference, m.graph.port("y").reference
    assert m.tangent([y], [u], np.ones(1), 1)[0] == OK
    assert m.messages == []


@pytest.mark.parametrize("h", [5e-324, 1e-300, 5.7e-15, 9e-13])
def test_residue_of_a_clock_is_no_step(make: Make, h: float) -> None:
    """Importers that add up their steps ask for the rest to the stop time; below 1e-12 s, it is rounding."""
    want, m = make(), make()
    for unit in (want, m):
        unit.initialize(stop=1.0)
    got, before = m.run(U[:20]), m.memory()
    assert m.step(20 * H, h) == OK
    assert m.step(20 * H, h) == OK
    assert (m.memory(), m.messages) == (before, [])
    got += m.run(U[20:40], first=20)
    assert got == want.run(U[:40])
    assert m.memory() == want.memory()


@pytest.mark.parametrize(("t", "stop"), [(1e6, None), (1e6, 2e6), (0.0, 2e6), (1e6, 1e6), (-2e6, 0.0), (1e16, None)])
def test_residue_follows_the_size_of_the_times(make: Make, t: float, stop: float | None) -> None:
    """A few units in the last place of the larger of |t| and the stop time: 2^-53 is half of one, relative to it."""
    m = make()
    m.initialize(t, stop)
    before = m.memory()
    last = 2.0**-52 * max(abs(t), abs(stop or 0.0))
    assert m.step(t, 8 * last) == OK
    assert m.memory() == before
    if stop != t:
        assert m.step(t, 1e4 * last) == OK
        assert m.memory() != before


@pytest.mark.parametrize("n", [1000, 100_000])
def test_a_clock_that_adds_its_steps_reaches_the_stop_time(make: Make, n: int) -> None:
    """The stop time is n steps; the last step is what the sum of n steps lacks (if it exceeds the stop time: none)."""
    m, h = make(), 1.0 / n + 1e-18
    stop = n * h
    m.initialize(stop=stop)
    t = 0.0
    while stop - t > 0:
        step = min(h, stop - t)
        assert m.step(t, step) == OK, (t, step, m.messages)
        t += step


def test_real_steps_of_such_a_size_are_refused(make: Make) -> None:
    """A run in steps below 1e-12 s does not stand still unnoticed: its clock leaves that of the unit."""
    m = make()
    m.initialize()
    statuses = [m.step(k * 1e-13, 1e-13) for k in range(20)]
    assert statuses[0] == OK
    assert ERROR in statuses
    assert m.messages[0][2].endswith("but the unit is at t = 0 s.")


@pytest.mark.parametrize("t", [0.0, 4 * H, 6 * H, math.nan, math.inf, -math.inf])
def test_step_from_another_time(make: Make, t: float) -> None:
    m = make()
    m.initialize()
    m.run(U[:5])
    before = m.memory()
    for h in (H, 5.7e-15):  # the residue of a clock too
        assert m.step(t, h) == ERROR
        assert m.messages[-1][2].endswith("but the unit is at t = 0.005 s.")
    assert m.memory() == before


# ---- what a block or an input refuses --------------------------------------------------------------------------------
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


def test_an_overflow_is_an_error(make: Make) -> None:
    """A value that is not finite is not passed on as if it were one; a state saved before brings the unit back."""
    m, late = make(single("backlash_sum")), make(single("backlash_sum"))
    m.initialize()
    assert m.step(0.0) == OK
    before = m.save()
    for each in (m, late):
        assert each.set("w0", 1e10) == OK
        assert each.set("u", 1e300) == OK
    assert m.step(H) == ERROR
    told = f"'y' is infinite at t = {2 * H:g} s."
    assert m.messages.pop()[2].startswith(told)
    unit = Unit(single("backlash_sum"))
    unit.initialize(H, w0=1e10)
    unit.set("u", 1e300)
    with pytest.raises(InputError, match=re.escape(told)):
        unit.do_step(H, H)
    assert late.enter() == OK
    for each in (m, late):
        assert each._access("Get", "y", None)[0] == DISCARD
        assert each.messages.pop()[2].startswith("'y' is infinite at t = ")
    assert m.restore(before) == OK
    assert m.step(H) == OK
    assert math.isfinite(m.get("y"))


# ---- inputs without a value -----------------------------------------------------------------------------------------
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_step_waits_for_every_input(make: Make, bad: float) -> None:
    """Inputs that were mended may be set again and again: the others are still missing."""
    m = make(pair())
    m.initialize()
    before = m.memory()
    assert m.set("us", bad, 1.0) == DISCARD
    assert m.set("ua", bad) == DISCARD
    assert m.set("ua", bad) == DISCARD
    assert m.step(0.0) == DISCARD
    assert m.memory() == before, "the unit advanced with an invalid input"
    word = "NaN" if math.isnan(bad) else "infinite"
    text = f"The input 'us' is {word}: no step is made until it has a finite value again."
    assert m.messages == [(WARNING, "logStatusWarning", text)], "one warning"
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


# ---- A source follows the steps, not the rounding of an importer's clock; a step that is no step of the model
AMPLITUDE, FREQUENCY = 0.8, 7.0
SINE = Node("ref", "reference", {}, {"amplitude": AMPLITUDE, "frequency": FREQUENCY})


def source(step: float = H) -> Graph:
    return Graph.single(SINE).with_step(step)


def added(start: float, h: float, n: int) -> list[float]:
    """Times of a clock that adds up its steps."""
    times = [start]
    for _ in range(n - 1):
        times.append(times[-1] + h)
    return times


def stepped(m: Master, times: list[float], h: float = H) -> list[float]:
    """Outputs after steps of h from these times."""
    found = []
    for t in times:
        assert m.step(t, h) == OK
        found.append(m.get("r"))
    return found


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("start", "h", "n"), [(0.0, H, 100_000), (0.7, H, 3000), (-3.1, H, 5000), (1e4, 1 / 3000, 5000)]
)
def test_a_clock_that_adds_up_gives_the_bits_of_one_that_counts(make: Make, start: float, h: float, n: int) -> None:
    m = {name: make(source(h)) for name in ("adds", "counts")}
    times = {"adds": added(start, h, n), "counts": [start + k * h for k in range(n)]}
    assert times["adds"] != times["counts"]
    for one in m.values():
        one.initialize(start)
    got = {name: stepped(m[name], times[name], h) for name in m}
    assert got["adds"] == got["counts"]
    unit = Unit(source(h))
    unit.initialize(start)
    for t, want in zip(times["adds"][:3000], got["counts"], strict=False):
        unit.do_step(t, h)
        assert unit.get("r") == want


def test_it_does_so_from_a_saved_state_on(make: Make) -> None:
    m, other = make(source()), make(source())
    times = added(0.1, H, 4000)
    m.initialize(0.1)
    stepped(m, times[:1000])
    content = m.serialize(m.save())
    want = stepped(m, times[1000:])
    status, state = other.deserialize(content)
    assert status == OK
    assert other.restore(state) == OK, "the start time is part of the state"
    assert stepped(other, [0.1 + k * H for k in range(1000, 4000)]) == want


def closed(t: float) -> float:
    return AMPLITUDE * math.sin(2 * math.pi * FREQUENCY * t)


@pytest.mark.parametrize("offset", [1e-9, 1e-4, 0.3])
def test_a_clock_beside_the_steps_keeps_its_times(make: Make, offset: float) -> None:
    """A first step that is longer by a share of H: what follows is no multiple of H, nor rounding of one."""
    m = make(source())
    m.initialize()
    assert m.step(0.0, H * (1 + offset)) == OK
    t = H * (1 + offset)
    for _ in range(100):
        assert m.step(t, H) == OK
        t += H
        assert m.get("r") == pytest.approx(closed(t), abs=1e-14)


def test_a_step_of_another_length_ends_where_it_says(make: Make) -> None:
    m = make(source())
    m.initialize()
    t = 0.0
    for h in [H / 3, H / 3, H / 3, H / 2, H / 2, H * (1 + 1e-9)] * 50:
        assert m.step(t, h) == OK
        t += h
        assert m.get("r") == pytest.approx(closed(t), abs=1e-14)
        if m.fmi == 3:
            assert m.last_time.value == t
