"""What a description says: dependencies are complete, ranges and units of measure of a fit, bits as in Python."""

from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu
from fmu_events import Events
from fmu_master import BLOCKS, OK, H, loop, mixed, rows, single
from runners import run_by_fmpy, run_by_unit

import hystfmu as hy
from hystfmu import Dataset, Graph, Input, Model, Node, Output
from hystfmu.fmu import export_fmu
from hystfmu.fmu.write.measures import base_unit
from hystfmu.graph.dependencies import dependencies
from hystfmu.identify import fit

GRAPHS: dict[str, Callable[[], Graph]] = {"loop": loop, "mixed": mixed, **{n: lambda n=n: single(n) for n in BLOCKS}}


def described(graph: Graph, path: Path, fmi: int) -> Any:
    return read_model_description(str(export_fmu(graph, path, fmi)))  # type: ignore[arg-type]


@pytest.mark.some(20)
@pytest.mark.parametrize("name", list(GRAPHS))
def test_undeclared_dependencies_have_no_effect(folder: Path, fmi: int, name: str) -> None:
    """In Event Mode at a sample, each input and each state is changed separately, upwards and downwards."""
    graph = GRAPHS[name]()
    k, u = 6, rows(graph, 7)
    description = described(graph, folder / "x.fmu", fmi)
    n_x = len(graph.continuous_states)
    unknowns = [*description.outputs, *description.derivatives]
    knowns = [s for p in graph.ports if p.kind == "input" for s in (p.scalar_names if fmi == 2 else [p.name] * p.size)]
    knowns += [x.name for x in graph.continuous_states]
    sizes = [p.size for p in graph.ports if p.kind == "output"]
    widths = [1] * sum(sizes) if fmi == 2 else sizes
    moved: set[tuple[str, str]] = set()

    def answer(known: int, by: float = 0.0) -> list[float]:
        m = Events(graph, folder / graph.token, fmi, interface="me")
        m.integrate(u[:k], H, lambda f, t, end, x: x + (end - t) * f(t, x))
        x, row = m.x, u[k].copy()
        if known >= 0:
            (row if known < len(row) else x)[known if known < len(row) else known - len(row)] += by
        assert m.set_time(k * H) == OK
        if n_x:
            assert m.set_x(x) == OK
        assert m.completed() == OK
        assert m.call("EnterEventMode") == OK
        m.put(row)
        y = m.outputs() + list(m.derivatives() if n_x else ())
        m.free()
        return y

    want = answer(-1)
    for (j, known), by in product(enumerate(knowns), (0.37, -0.37)):
        got, at = answer(j, by), 0
        for unknown, width in zip(unknowns, [*widths, *[1] * n_x], strict=True):
            if got[at : at + width] != want[at : at + width]:
                moved.add((unknown.variable.name, known))
            at += width
    named = {(x.variable.name, v.name) for x in unknowns for v in x.dependencies or () if v.causality != "independent"}
    assert moved <= named, f"not declared: {sorted(moved - named)}"
    if name in ("creep", "bouc_wen_oscillator", "maxwell_slip_oscillator", "prandtl_ishlinskii", "delay"):
        assert moved == named, f"declared without effect: {sorted(named - moved)}"


def test_sources_depend_on_the_time(tmp_path: Path) -> None:
    """FMI 3.0 has a variable for the time."""
    for name, depends in (("reference", True), ("disturbance", True), ("noise", False), ("sum", False)):
        for unknown in described(single(name), tmp_path / "x.fmu", 3).outputs:
            assert ("time" in [v.name for v in unknown.dependencies]) == depends, name


def test_names_and_order_of_states_and_derivatives(tmp_path: Path, fmi: int) -> None:
    description = described(loop(), tmp_path / "x.fmu", fmi)
    assert [u.variable.name for u in description.derivatives] == ["der(dyn_v_1)", "der(dyn_v_2)"]
    states = [u.variable.derivative for u in description.derivatives]
    assert [x.name for x in states] == ["dyn_v_1", "dyn_v_2"]
    assert description.numberOfContinuousStates == 2
    assert description.numberOfEventIndicators == 0
    assert [u.variable.unit for u in description.derivatives] == ["1/s", "1/s"]


def test_units_of_measure_of_derivatives(tmp_path: Path, fmi: int) -> None:
    description = described(single("bouc_wen_oscillator"), tmp_path / "x.fmu", fmi)
    assert [u.variable.unit for u in description.derivatives] == ["m/s", "m/s2", "N/s"]
    rate = next(u for u in description.unitDefinitions if u.name == "N/s").baseUnit
    assert (rate.kg, rate.m, rate.s) == (1, 1, -3)


def test_capabilities(tmp_path: Path, fmi: int) -> None:
    """Requirements and capabilities of a graph are declared."""
    for name, steps in (("prandtl_ishlinskii", True), ("transfer_function", True), ("pid", False), ("bouc_wen", True)):
        description = described(single(name), tmp_path / "x.fmu", fmi)
        assert description.modelExchange.needsCompletedIntegratorStep == steps
        assert description.modelExchange.canGetAndSetFMUstate
        assert description.coSimulation.canHandleVariableCommunicationStepSize == (name != "pid")
        if fmi == 3:
            assert description.coSimulation.hasEventMode
    assert described(single("delay").with_step(0), tmp_path / "x.fmu", fmi).modelExchange is None


def test_elements_of_an_array_are_distinguished() -> None:
    """States of one block reach different outputs through a block with several inputs."""
    nodes = [Node("a", "creep"), Node("b", "creep"), Node("s", "sum", {"n": 2}), Node("o", "bouc_wen_oscillator")]
    wires = [("a.y", "s.u[1]"), ("b.y", "s.u[2]"), ("s.y", "o.u")]
    inputs = [Input("p", ("a.u",)), Input("q", ("b.u",))]
    graph = Graph(nodes, wires, inputs, [Output("y", "o.y"), Output("z", "o.z"), Output("w", "s.y")])
    outputs, rates = dependencies(graph.nodes, graph.links, graph.ports)
    states = [x.name for x in graph.continuous_states]
    assert states == ["a_q", "b_q", "o_q", "o_v", "o_f"]
    named = {n: {states[k] for k in known.states} | known.inputs for n, known in outputs.items()}
    assert named == {"y": {"o_q"}, "z": {"o_f"}, "w": {"a_q", "b_q"}}
    assert [{states[k] for k in known.states} | known.inputs for known in rates] == [
        {"a_q", "p"}, {"b_q", "q"}, {"o_v"}, {"a_q", "b_q", "o_q", "o_v", "o_f"}, {"o_v", "o_f"},
    ]  # fmt: skip


def test_the_force_of_the_duhem_oscillator_depends_on_itself() -> None:
    """g' = v f(s g): a table that clips its argument must not hide it."""
    graph = Graph.single(Node("d", "duhem_oscillator", {}, {"f": [5.0, 4.0, 3.0, 2.0, 1.0]}))
    _, rates = dependencies(graph.nodes, graph.links, graph.ports)
    assert [sorted(known.states) for known in rates] == [[1], [0, 1, 2], [1, 2]]


# ---- a model with a record -------------------------------------------------------------------------------------------
# unit of measure: exponents of kg, m, s, A, K, rad; factor; offset (BIPM, The International System of Units, 9th ed.)
UNITS: dict[str, tuple[tuple[int, ...], float, float]] = {
    "um": ((0, 1, 0, 0, 0, 0), 1e-6, 0.0), "ms": ((0, 0, 1, 0, 0, 0), 1e-3, 0.0),
    "h": ((0, 0, 1, 0, 0, 0), 3600.0, 0.0), "kV": ((1, 2, -3, -1, 0, 0), 1e3, 0.0),
    "kV/mm": ((1, 1, -3, -1, 0, 0), 1e6, 0.0), "um/V": ((-1, -1, 3, 1, 0, 0), 1e-6, 0.0),
    "N.s/m2": ((1, -1, -1, 0, 0, 0), 1.0, 0.0), "MPa": ((1, -1, -2, 0, 0, 0), 1e6, 0.0),
    "mN": ((1, 1, -2, 0, 0, 0), 1e-3, 0.0), "Oe": ((0, -1, 0, 1, 0, 0), 1e3 / (4 * np.pi), 0.0),
    "degC": ((0, 0, 0, 0, 1, 0), 1.0, 273.15), "degC/min": ((0, 0, -1, 0, 1, 0), 1 / 60, 0.0),
    "deg": ((0, 0, 0, 0, 0, 1), np.pi / 180, 0.0), "%": ((0, 0, 0, 0, 0, 0), 0.01, 0.0),
    "kg": ((1, 0, 0, 0, 0, 0), 1.0, 0.0),
}  # fmt: skip


@pytest.mark.parametrize("name", UNITS)
def test_base_units(name: str) -> None:
    exponents, factor, offset = UNITS[name]
    got = base_unit(name)
    assert got is not None
    assert tuple(int(got.get(k, 0)) for k in ("kg", "m", "s", "A", "K", "rad")) == exponents
    assert float(got.get("factor", 1.0)) == pytest.approx(factor, rel=1e-15)
    assert float(got.get("offset", 0.0)) == offset


@pytest.mark.parametrize("name", ["furlong", "V/", "", "kdeg", "mmin", "m0", "V//A", "1e3", "u"])
def test_what_is_no_unit_of_measure_has_no_base_unit(name: str) -> None:
    assert base_unit(name) is None


@pytest.fixture(scope="module")
def model() -> Model:
    """A play between 20 V and 90 V, fitted to a record with a step of one millisecond."""
    t = np.arange(800) * 1e-3
    u = 55 + 35 * np.sin(2 * np.pi * 5 * t) * np.exp(-2 * t)
    y, z = np.empty_like(u), u[0]
    for k, v in enumerate(u):
        z = max(v - 8, min(v + 8, z))
        y[k] = 0.3 * v + 0.1 * z
    data = Dataset(t, u, y, name="stack 7", unit_u="V", unit_y="um")
    return fit(data, "prandtl_ishlinskii", seed=1, N=8)


def ports(model: Model, path: Path, fmi: int) -> dict[str, Any]:
    description = fmpy.read_model_description(str(export_fmu(model, path, fmi)))  # type: ignore[arg-type]
    return {v.name: v for v in description.modelVariables} | {"experiment": description.defaultExperiment}


@pytest.mark.turn("good FMUs")
@pytest.mark.some(1)
def test_ranges_sizes_and_texts(model: Model, tmp_path: Path, fmi: int) -> None:
    lo, hi = model.provenance["trained_u"]
    found = ports(model, tmp_path / "m.fmu", fmi)
    u, y = found["u"], found["y"]
    assert (float(u.min), float(u.max)) == (min(lo, float(u.start)), hi)
    assert float(u.nominal) == pytest.approx(hi, rel=0.05)
    assert float(y.nominal) == pytest.approx(0.4 * hi, rel=0.1)  # the play follows its input
    assert (y.min, y.max) == (None, None)  # a model may leave the range on its way
    assert (u.description, y.description) == (
        "input of the record stack 7, in V",
        "output of the record stack 7, in um",
    )
    assert (u.unit, y.unit) == ("V", "um")
    threshold, weight = (next(v for n, v in found.items() if n.startswith(f"hysteresis_{k}")) for k in "rw")
    assert (threshold.unit, weight.unit) == ("V", "1")
    assert hy.validate(tmp_path / "m.fmu") == []


def test_the_step_has_no_dust(model: Model, tmp_path: Path, fmi: int) -> None:
    dusty = Model(model.key, model.graph, 0.0010000000000000009, model.text, model.fit, model.provenance)
    experiment = ports(dusty, tmp_path / "m.fmu", fmi)["experiment"]
    assert (experiment.stepSize, experiment.stopTime) == ("0.001", "1.0")
    other = Model(model.key, model.graph, 1 / 3, model.text, model.fit, model.provenance)
    assert float(ports(other, tmp_path / "n.fmu", fmi)["experiment"].stepSize) == 1 / 3


def test_a_model_that_states_no_range_has_none(model: Model, tmp_path: Path) -> None:
    bare = Model(model.key, model.graph, model.step, model.text)
    u = ports(bare, tmp_path / "m.fmu", 2)["u"]
    assert (u.min, u.max) == (None, None)


# ---- bits ------------------------------------------------------------------------------------------------------------
EVERY = [*BLOCKS, "loop"]


def graph_of(name: str) -> Graph:
    return loop() if name == "loop" else single(name)


@pytest.mark.some(20)
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("name", EVERY)
def test_same_bits_and_valid(name: str, fmi: int, tmp_path: Path) -> None:
    graph = graph_of(name)
    u = rows(graph)
    want = graph.executor().run(u, graph.n_outputs, H)
    assert np.isfinite(want).all()
    assert np.ptp(want, axis=0).max() > 1e-3, "the outputs must vary"
    assert run_by_unit(graph, u, H).tobytes() == want.tobytes()
    fmu = export_fmu(graph, tmp_path / f"{name}{fmi}.fmu", fmi)  # type: ignore[arg-type]
    assert validate_fmu(str(fmu)) == []
    assert run_by_fmpy(fmu, tmp_path / f"{fmi}", u, H).tobytes() == want.tobytes()
