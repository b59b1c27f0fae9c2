"""Event Mode: trials have no effect, an update takes effect once, and no output is delayed by a step."""

import ctypes as C

import numpy as np
import pytest
from fmu_events import Events
from fmu_master import BLOCKS, ERROR, OK, Array, H, Make, mixed, only_fmi3, rows, single

from hystfmu.graph import Graph, Input, Node, Output


def stepped(m: Events, u: Array, h: float = H) -> Array:
    """Run Co-Simulation with Event Mode; the inputs of a row are set in the event at its time."""
    y = [m.begin(u[0])]
    for k in range(1, len(u)):
        assert m.step((k - 1) * h, h) == OK
        y.append(m.event(u[k]))
    return np.array(y)


# ---- Co-Simulation with Event Mode ----------------------------------------------------------------------------------
@pytest.mark.some(20)
@only_fmi3
@pytest.mark.parametrize("name", BLOCKS)
def test_no_block_adds_a_delay(make: Make, name: str) -> None:
    """Without continuous states, the output in an event equals that after a step with the new input."""
    graph = single(name)
    u = rows(graph, 80)
    want = graph.executor().run(u, graph.n_outputs, H)
    got = stepped(make(graph, "event"), u)
    if graph.continuous_states:  # the input is held from event to event: the step is made with the row before
        want = graph.executor().run(np.vstack([u[:1], u[:-1]]), graph.n_outputs, H)
    assert got.tobytes() == want.tobytes()


CONTROL = Node("c", "pid", {}, {"Kp": 0.4, "Ki": 60.0})
PLANT = Node("p", "prandtl_ishlinskii", {}, {"w0": 0.3, "r": [0.1, 0.4], "w": [0.5, 0.2]})


@pytest.mark.parametrize("interface", ["event", "me"])
def test_two_units_one_after_the_other_without_delay(make: Make, fmi: int, interface: str) -> None:
    """A controller FMU and a plant FMU coupled in Event Mode give the same bits as both in one FMU."""
    if (fmi, interface) == (2, "event"):
        pytest.skip("FMI 2.0 has Event Mode in Model Exchange only")
    both = Graph(
        [CONTROL, PLANT], [("c.u", "p.u")], [Input("r", ("c.y_d",))], [Output("y", "p.y"), Output("u", "c.u")], step=H
    )
    r = rows(both, 80)
    want = both.executor().run(r, 2, H)
    c, p = (make(Graph.single(n).with_step(H), interface) for n in (CONTROL, PLANT))
    got = np.empty_like(want)
    for k in range(len(r)):
        for m in (c, p):
            if k == 0:
                assert m.enter() == OK
                continue
            if interface == "me":
                assert m.set_time(k * H) == OK
                assert m.completed() == OK
            else:
                assert m.step((k - 1) * H) == OK
            assert m.call("EnterEventMode") == OK
        for guess in (5.0, -5.0, float(r[k, 0])):  # an importer that iterates
            assert c.set("y_d", guess) == OK
            assert p.set("u", c.get("u")) == OK
            got[k] = p.get("y"), c.get("u")
        for m in (c, p):
            if k == 0:
                assert m.call("ExitInitializationMode") == OK
            assert m.update() == OK
            m.leave()
    assert got.tobytes() == want.tobytes()


@only_fmi3
def test_no_step_requests_event_mode(make: Make) -> None:
    """No output is discrete: an importer that hands over continuous inputs between steps need not handle events."""
    for graph in (single("pid"), single("prandtl_ishlinskii")):
        m = make(graph, "event")
        m.begin(rows(graph, 1)[0])
        flags, last = [C.c_bool(True) for _ in range(3)], C.c_double()
        arguments = [*map(C.byref, flags), C.byref(last)]
        assert m.call("DoStep", C.c_double(0), C.c_double(H), C.c_bool(True), *arguments) == OK
        assert [f.value for f in flags] == [False, False, False]
        assert last.value == H


# ---- trials ---------------------------------------------------------------------------------------------------------
INTERFACES = [(2, "me"), (3, "me"), (3, "event")]
each = pytest.mark.parametrize(("fmi", "interface"), INTERFACES, indirect=["fmi"], ids=lambda v: str(v))


def at_event(m: Events) -> None:
    """Enter Event Mode at t = H, where a sample is due."""
    if m.interface == "me":
        assert m.set_time(H) == OK
        assert m.completed() == OK
    else:
        assert m.step(0.0) == OK
    assert m.call("EnterEventMode") == OK


@each
def test_trials_have_no_effect(make: Make, interface: str) -> None:
    graph = mixed()
    plain, busy = make(graph, interface), make(graph, interface)
    for m in (plain, busy):
        m.begin(np.array([0.2]))
        at_event(m)
    for guess in (3.0, -3.0, 0.4):
        assert busy.set("u", guess) == OK
        busy.outputs()
        busy.memory()
    assert plain.set("u", 0.4) == OK
    for m in (plain, busy):
        assert m.update() == OK
    assert busy.memory() == plain.memory()
    assert busy.outputs() == plain.outputs()


@each
def test_an_event_without_an_update_has_no_effect(make: Make, interface: str) -> None:
    m = make(single("delay"), interface)
    m.begin(np.array([0.2]))
    at_event(m)
    before = m.memory()
    m.outputs()
    assert m.memory() == before
    m.leave()
    assert m.call("EnterEventMode") == OK
    assert m.memory() == before
    y = m.outputs()
    assert m.set("u", 0.9) == OK
    assert m.update() == OK
    m.leave()
    if interface == "me":
        assert m.set_time(2 * H) == OK
        assert m.completed() == OK
    else:
        assert m.step(H) == OK
    assert m.event(np.array([0.0])) == [0.9], "the sample was still due"
    assert y == [0.2]


@each
def test_the_second_update_changes_nothing(make: Make, interface: str) -> None:
    m = make(mixed(), interface)
    m.begin(np.array([0.2]))
    at_event(m)
    m.put(np.array([0.9]))
    assert m.update() == OK
    once, y = m.memory(), m.outputs()
    assert m.update() == OK
    assert (m.memory(), m.outputs()) == (once, y)


# ---- saved states ---------------------------------------------------------------------------------------------------
@each
def test_restore_in_every_mode(make: Make, interface: str) -> None:
    """In Event Mode with a trial pending, and between events; in another instance from bytes."""
    u = rows(mixed(), 40)
    m, other = make(mixed(), interface), make(mixed(), interface)

    def go(m: Events, first: int) -> list[list[float]]:
        y = []
        for k in range(first, 40):
            if interface == "me":
                assert m.set_time(k * H) == OK
                assert m.set_x(m.x + H * m.derivatives()) == OK
                assert m.completed() == OK
            else:
                assert m.step((k - 1) * H) == OK
            y.append(m.event(u[k]))
        return y

    m.begin(u[0])
    go_on = [m.save()]
    want = go(m, 1)
    content = m.serialize(go_on[0])
    for target in (m, other):
        status, state = target.deserialize(content)
        assert status == OK
        assert target.restore(state) == OK
        assert go(target, 1) == want
    assert m.restore(go_on[0]) == OK
    at_event(m)
    m.put(np.array([2.0]))
    tried = m.outputs()
    state = m.save()
    assert m.update() == OK
    assert m.restore(state) == OK
    assert m.outputs() == tried
    assert m.update() == OK
    assert m.outputs() == tried


def test_a_state_belongs_to_its_interface(make: Make, fmi: int) -> None:
    units = [make(mixed(), i) for i in (("cs", "me") if fmi == 2 else ("cs", "event", "me"))]
    contents = [m.memory() for m in units]
    for k, m in enumerate(units):
        for j, content in enumerate(contents):
            assert m.deserialize(content)[0] == (OK if k == j else ERROR)
            if k != j:
                end = "it belongs to another interface of the standard."
                assert m.messages[-1][2] == f"The serialized state cannot be read: {end}"


@each
def test_reset_gives_a_new_instance(make: Make, interface: str) -> None:
    new, used = make(mixed(), interface), make(mixed(), interface)
    used.begin(np.array([0.7]), t=3.0)
    assert used.call("EnterEventMode") == OK
    used.put(np.array([2.0]))
    used.outputs()
    assert used.call("Reset") == OK
    assert used.memory() == new.memory()
