"""The sample time of a model is a contract: a step of n sample times has the bits of n steps, any other is refused."""

import ctypes as C
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description
from fmu_events import Events
from fmu_master import DISCARD, ERROR, OK, Array, H, Make, Master, loop, mixed, only_fmi2, only_fmi3, rows, single

from hystfmu import Graph, Input, InputError, Node, Output, Unit
from hystfmu.fmu import export_fmu

INTERFACES = [(2, "cs"), (3, "cs"), (3, "event")]
each = pytest.mark.parametrize(("fmi", "interface"), INTERFACES, indirect=["fmi"], ids=lambda v: str(v))
U = rows(mixed(), 60)


def looped() -> Graph:
    """Return operator and lag in a loop: no block is sampled, but one reads an output of the last step."""
    nodes = [
        Node("error", "sum", {"n": 2}, {"k": [1.0, -0.5]}),
        Node("op", "backlash_sum", {}, {"w0": 0.4, "r": [0.1, 0.3], "w": [0.5, 0.2]}),
        Node("lag", "transfer_function", {"nb": 0, "na": 1}, {"b": [1.0], "a": [2e-3, 1.0]}),
    ]
    wires = [("error.y", "op.u"), ("op.y", "lag.u"), ("lag.y", "error.u[2]")]
    return Graph(nodes, wires, [Input("u", ("error.u[1]",))], [Output("y", "lag.y")], sort=False, step=H)


def sourced() -> Graph:
    """Return a source of the time before an operator."""
    plays = Node("op", "backlash_sum", {}, {"w0": 0.4, "r": [0.1, 0.3], "w": [0.5, 0.2]})
    nodes = [Node("ref", "reference", {}, {"amplitude": 0.8, "frequency": 37.0}), plays]
    return Graph(nodes, [("ref.r", "op.u")], [], [Output("y", "op.y")], step=H)


GRAPHS = {
    "narx": lambda: single("narx_network"),
    "creep inverse": lambda: single("creep_inverse"),
    "delay": lambda: single("delay"),
    **{f.__name__: f for f in (mixed, loop, looped, sourced)},
}
every_graph = pytest.mark.parametrize("graph", GRAPHS.values(), ids=list(GRAPHS))


def held(graph: Graph, n: list[int]) -> tuple[Array, Array]:
    """Return input rows, and the outputs of the model's own steps with row k held over n[k] of them."""
    u = rows(graph, len(n))
    y = graph.executor().run(np.repeat(u, n, axis=0), graph.n_outputs, graph.step)
    return u, y[np.cumsum(n) - 1]


# ---- steps that are served ------------------------------------------------------------------------------------------
@each
@every_graph
def test_a_step_of_n_sample_times_has_the_bits_of_n_steps(
    make: Make, interface: str, graph: Callable[[], Graph]
) -> None:
    """Whatever the order of lengths; an event of the importer without new inputs changes nothing."""
    g = graph()
    n = [1, 1, 2, 3, 5, 1, 40, 2, 8, 8]
    u, want = held(g, n)
    m: Events = Events(g, make(g).resources.parents[1], make(g).fmi, interface=interface)
    assert m.enter() == OK
    m.put(u[0])
    assert m.call("ExitInitializationMode") == OK
    if interface == "event":
        assert m.update() == OK
        m.leave()
    got, t = [m.outputs()], 0
    for k in range(1, len(n)):
        m.put(u[k])
        assert m.step(t * H, n[k] * H) == OK, m.messages
        t += n[k]
        got.append(m.outputs())
        if interface == "event" and k % 2:
            assert m.call("EnterEventMode") == OK
            assert m.outputs() == got[-1]
            assert m.update() == OK
            m.leave()
    assert np.array(got).tobytes() == want.tobytes()
    m.free()


@pytest.mark.some(30)
@every_graph
@pytest.mark.parametrize("part", [0.25, 0.5, 0.75, 1.5, 2.01, 1e6 + 1])
def test_a_step_of_another_length_is_refused_in_one_line(make: Make, graph: Callable[[], Graph], part: float) -> None:
    m, plain = make(graph()), make(graph())
    for one in (m, plain):
        one.initialize()
        assert one.step(0.0) == OK
    assert m.step(H, part * H) == ERROR
    ((_, _, text),) = m.messages
    start = "The step must be a multiple (1 to 1000000) of the sample time 0.001 s of the model. Got "
    assert text.startswith(start)
    assert float(text.removeprefix(start).removesuffix(" s instead.")) == pytest.approx(part * H)
    assert m.memory() == plain.memory(), "nothing has changed"
    for one in (m, plain):
        assert one.step(H) == OK
    assert m.memory() == plain.memory()


@every_graph
def test_a_unit_in_python_keeps_the_same_contract(graph: Callable[[], Graph]) -> None:
    g = graph()
    n = [1, 1, 2, 3, 5, 1, 40, 2, 8, 8]
    u, want = held(g, n)
    unit, inputs = Unit(g), [name for p in g.ports if p.kind == "input" for name in p.scalar_names]
    outputs = [name for p in g.ports if p.kind == "output" for name in p.scalar_names]
    unit.initialize(0.0, **dict(zip(inputs, u[0], strict=True)))
    got, t = [[unit.get(name) for name in outputs]], 0.0
    for row, many in zip(u[1:], n[1:], strict=True):
        for name, value in zip(inputs, row, strict=True):
            unit.set(name, value)
        for part in (0.25, 0.5, 0.75, 1.5, 2.01, 1e6 + 1):
            with pytest.raises(
                InputError, match=r"^The step must be a multiple .* time 0.001 s of the model\. Got .* s"
            ):
                unit.do_step(t, part * H)
        unit.do_step(t, many * H)
        t += many * H
        got.append([unit.get(name) for name in outputs])
    assert np.array(got).tobytes() == want.tobytes()


@pytest.mark.parametrize("graph", [single("prandtl_ishlinskii"), single("creep"), single("reference")])
def test_other_models_take_steps_of_any_length(make: Make, graph: Graph) -> None:
    m = make(graph)
    m.initialize()
    for t, h in ((0.0, 0.25 * H), (0.25 * H, 1.7 * H)):
        assert m.step(t, h) == OK


def test_without_a_sample_time_each_step_is_a_sample(make: Make) -> None:
    graph = single("delay").with_step(0.0)
    m = make(graph)
    m.initialize()
    got = []
    for k, h in enumerate((0.2, 0.7, 0.1)):
        assert m.set("u", k + 1.0) == OK
        assert m.step([0.0, 0.2, 0.9][k], h) == OK
        got.append(m.get("y"))
    assert got == graph.executor().run(np.array([[0.0], [1.0], [2.0], [3.0]]), 1, 1.0)[1:, 0].tolist()


def test_without_a_sample_time_an_importer_is_asked_for_equal_steps(fmi: int, tmp_path: Path) -> None:
    can = read_model_description(str(export_fmu(single("delay").with_step(0.0), tmp_path / "m.fmu", fmi))).coSimulation  # type: ignore[arg-type]
    assert not can.canHandleVariableCommunicationStepSize
    assert can.fixedInternalStepSize is None


@pytest.mark.parametrize("off", [1e-4, -1e-4])
def test_rounding_of_an_importer_is_no_other_step(make: Make, off: float) -> None:
    """An importer that counts nanoseconds: the model advances by its own step."""
    graph = mixed()
    m, t = make(graph), 0.0
    m.initialize()
    got = []
    for k in range(1, len(U)):
        assert m.set("u", float(U[k, 0])) == OK
        assert m.step(t, H * (1 + off)) == OK
        t += H * (1 + off)
        got.append([m.get(p.name) for p in graph.ports if p.kind == "output"])
    want = graph.executor().run(np.vstack([[0.0], U[1:]]), graph.n_outputs, H)[1:]
    assert np.array(got).tobytes() == want.tobytes()


# ---- inputs within a step -------------------------------------------------------------------------------------------
@only_fmi2
def test_derivatives_of_inputs_reach_every_sample(make: Make) -> None:
    graph = mixed()
    slope, n = 30.0, 4
    want = graph.executor().run(
        np.array([[0.0], *[[0.1 + slope * k * H] for k in range(1, n + 1)]]), graph.n_outputs, H
    )
    m = make(graph)
    m.initialize()
    assert m.set("u", 0.1) == OK
    u = C.byref(C.c_uint(m.ports["u"].reference))
    for value, status in ((1e300, ERROR), (slope, OK)):
        before = m.memory()
        given = C.byref(C.c_int(1)), C.byref(C.c_double(value if status == OK else 1e308))
        assert m.call("SetRealInputDerivatives", u, C.c_size_t(1), *given) == OK
        if status == ERROR:  # 4 ms of it are finite: it is no error
            assert m.call("SetRealInputDerivatives", u, C.c_size_t(1), given[0], C.byref(C.c_double(0.0))) == OK
            continue
        assert m.step(0.0, n * H) == status
        assert m.memory() != before
    np.testing.assert_allclose([m.get(p.name) for p in graph.ports if p.kind == "output"], want[-1], rtol=1e-13)
    assert m.get("u") == pytest.approx(0.1 + slope * n * H)


UPDATE = C.CFUNCTYPE(None, C.c_void_p, C.c_double, *[C.c_bool] * 4, C.c_void_p, C.c_void_p)


def asked(m: Master, given: Callable[[float], float]) -> tuple[Master, list[float]]:
    """Make an FMI 3.0 instance with updates of `u`, whose value `given` tells; return the list of their times, too."""
    told: list[float] = []

    def answer(_: object, t: float, *flags: object) -> None:
        told.append(t)
        made.set("u", given(t))

    update = UPDATE(answer)
    made = m.another(references=[m.ports["u"].reference], update=update)
    made.update = update  # type: ignore[attr-defined]
    made.initialize()
    return made, told


@only_fmi3
def test_an_intermediate_update_comes_before_every_sample(make: Make) -> None:
    n = 4
    m, times = asked(make(mixed()), lambda t: 0.1 + 30 * t)
    assert m.step(0.0, n * H) == OK
    np.testing.assert_allclose(times, H * np.arange(1, n + 1), rtol=1e-12)
    want = mixed().executor().run(np.array([[0.0], *[[0.1 + 30 * t] for t in times]]), 4, H)[-1]
    assert [m.get(p.name) for p in mixed().ports if p.kind == "output"] == want.tolist()
    m.free()


@only_fmi3
def test_an_update_without_a_value_ends_the_step_at_the_last_sample(make: Make) -> None:
    m, _ = asked(make(mixed()), lambda t: 0.1 if t < 2.5 * H else np.nan)
    assert m.step(0.0, 4 * H) == DISCARD
    assert m.last_time.value == pytest.approx(2 * H)
    assert m.set("u", 0.1) == OK
    want = mixed().executor().run(np.array([[0.0], [0.1], [0.1]]), 4, H)[-1]
    assert [m.get(p.name) for p in mixed().ports if p.kind == "output"] == want.tolist()
    m.free()


# ---- events in Co-Simulation ----------------------------------------------------------------------------------------
@only_fmi3
def test_a_state_between_a_step_and_its_event_is_restored_with_both(make: Make) -> None:
    graph = mixed()
    m, other = make(graph, "event"), make(graph, "event")
    m.begin(U[0])
    m.put(U[1])
    assert m.step(0.0) == OK
    content = m.memory()
    state = m.save()
    want = [m.event(U[2])]
    m.put(U[3])
    assert m.step(H) == OK
    want.append(m.outputs())
    status, loaded = other.deserialize(content)
    assert status == OK
    for one, kept in ((m, state), (other, loaded)):
        assert one.restore(kept) == OK
        got = [one.event(U[2])]
        one.put(U[3])
        assert one.step(H) == OK
        assert [*got, one.outputs()] == want


# ---- parameters after the initialisation ----------------------------------------------------------------------------
@pytest.mark.parametrize("interface", ["cs", "me"])
def test_a_set_that_changes_no_value_is_accepted_at_any_time(make: Make, fmi: int, interface: str) -> None:
    """Importers exist that set all parameters once more after the initialisation."""
    graph = single("backlash_sum")
    m, plain = make(graph, interface), make(graph, interface)
    starts = {p.name: p.start for p in graph.ports if p.is_parameter}
    assert any(p.kind == "fixed" for p in graph.ports)
    for one in (m, plain):
        one.initialize()
        if interface == "me":
            assert one.update() == OK
            one.leave()
    for name, values in starts.items():
        assert m.set(name, *values) == OK, m.messages
    assert m.messages == []
    if interface == "cs":
        assert m.run(U[:20, 0]) == plain.run(U[:20, 0])
    for name, values in starts.items():
        kind = m.ports[name].kind
        status = ERROR if kind == "fixed" or interface == "me" else OK
        assert m.set(name, *[x + 0.25 for x in values]) == status
        assert m.get(name) == pytest.approx(values if len(values) > 1 else values[0]) or status == OK
        assert m.set(name, *values) == OK


# ---- what the description says --------------------------------------------------------------------------------------
@every_graph
def test_the_description_states_the_sample_time(graph: Callable[[], Graph], fmi: int, tmp_path: Path) -> None:
    g = graph().with_step(2.5e-4)
    description = read_model_description(str(export_fmu(g, tmp_path / "m.fmu", fmi, "m", stop=0.2)))  # type: ignore[arg-type]
    can, experiment = description.coSimulation, description.defaultExperiment
    assert not can.canHandleVariableCommunicationStepSize
    assert can.fixedInternalStepSize == (None if fmi == 2 else "0.00025")
    assert (float(experiment.stepSize), float(experiment.stopTime)) == (2.5e-4, 0.2)


@pytest.mark.parametrize(("node", "step"), [
    (Node("f", "transfer_function", {"nb": 0, "na": 1}, {"b": [1.0], "a": [1e-5, 1.0]}), 2e-6),
    (Node("m", "modes", {"n": 2}, {"f_n": [10.0, 1e3], "zeta": [0.1, 0.02]}), 5e-5),
    (Node("c", "creep", {"n": 2}, {"T": [1.0, 20.0], "w": [0.1, 0.1]}), 0.2),
    (Node("p", "backlash_sum"), 1e-3),
], ids=lambda v: getattr(v, "type", v))  # fmt: skip
def test_the_step_of_a_model_without_one_follows_from_its_poles(node: Node, step: float, tmp_path: Path) -> None:
    graph = Graph.single(node)
    description = read_model_description(str(export_fmu(graph, tmp_path / "m.fmu")))
    assert description.coSimulation.canHandleVariableCommunicationStepSize
    assert float(description.defaultExperiment.stepSize) == step
    assert float(description.defaultExperiment.stopTime) == pytest.approx(1000 * step)
    page = (tmp_path / "m.fmu").read_bytes()
    assert len(page) > 1000
    assert re.fullmatch(r"\d+(\.\d+)?(e-?\d+)?", description.defaultExperiment.stepSize)
