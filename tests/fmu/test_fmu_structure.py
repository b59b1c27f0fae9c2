"""ModelStructure is correct: outputs and derivatives depend on what their dependencies list, and on nothing else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fmpy import read_model_description
from fmu_events import Events
from fmu_master import BLOCKS, OK, H, loop, mixed, rows, single

from hystfmu.fmu import export_fmu
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.graph.dependencies import dependencies

GRAPHS: dict[str, Callable[[], Graph]] = {"loop": loop, "mixed": mixed, **{n: lambda n=n: single(n) for n in BLOCKS}}


def described(graph: Graph, path: Path, fmi: int) -> Any:
    return read_model_description(str(export_fmu(graph, path, fmi)))  # type: ignore[arg-type]


@pytest.mark.parametrize("name", list(GRAPHS))
def test_undeclared_dependencies_have_no_effect(folder: Path, fmi: int, name: str) -> None:
    """In Event Mode at a sample, each input and each state is changed separately."""
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

    def answer(known: int) -> list[float]:
        m = Events(graph, folder / graph.token, fmi, interface="me")
        m.integrate(u[:k], H, lambda f, t, end, x: x + (end - t) * f(t, x))
        x, row = m.x, u[k].copy()
        if known >= 0:
            (row if known < len(row) else x)[known if known < len(row) else known - len(row)] += 0.37
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
    for j, known in enumerate(knowns):
        got, at = answer(j), 0
        for unknown, width in zip(unknowns, [*widths, *[1] * n_x], strict=True):
            if got[at : at + width] != want[at : at + width]:
                moved.add((unknown.variable.name, known))
            at += width
    named = {(x.variable.name, v.name) for x in unknowns for v in x.dependencies or () if v.causality != "independent"}
    assert moved <= named, f"not declared: {sorted(moved - named)}"
    if name in ("creep", "bouc_wen_oscillator", "prandtl_ishlinskii", "delay"):
        assert moved == named, f"declared without effect: {sorted(named - moved)}"


def test_sources_depend_on_the_time(tmp_path: Path) -> None:
    """FMI 3.0 has a variable for the time."""
    for name, depends in (("reference", True), ("disturbance", True), ("noise", False), ("sum", False)):
        for unknown in described(single(name), tmp_path / "x.fmu", 3).outputs:
            assert ("time" in [v.name for v in unknown.dependencies]) == depends, name


def test_names_and_order_of_states_and_derivatives(tmp_path: Path, fmi: int) -> None:
    description = described(loop(), tmp_path / "x.fmu", fmi)
    names = [u.variable.name for u in description.derivatives]
    assert names == ["der(dyn_v_1)", "der(dyn_v_2)"]
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
        {"a_q", "p"},
        {"b_q", "q"},
        {"o_v"},
        {"a_q", "b_q", "o_q", "o_v", "o_f"},
        {"o_v", "o_f"},
    ]


def test_the_force_of_the_duhem_oscillator_depends_on_itself() -> None:
    """g' = v f(s g): a table that clips its argument must not hide it."""
    graph = Graph.single(Node("d", "duhem_oscillator", {}, {"f": [5.0, 4.0, 3.0, 2.0, 1.0]}))
    _, rates = dependencies(graph.nodes, graph.links, graph.ports)
    assert [sorted(known.states) for known in rates] == [[1], [0, 1, 2], [1, 2]]
