"""What a scenario reads of a foreign FMU's description, from descriptions made by hand; and values of our units."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.scenario.system import foreign as module
from hystfmu.scenario.system.case import (
    changed,
    first_outputs,
    parameter_names,
    scalar_names,
    start_values,
    with_values,
)
from hystfmu.scenario.system.foreign import Foreign, _ports


def variable(name: str, causality: str = "input", type_: str = "Float64", start: Any = None, **more: Any) -> Any:
    facts = {"dimensions": [], "unit": None, "description": None, "clocks": None, "variability": "continuous"}
    return SimpleNamespace(name=name, causality=causality, type=type_, start=start, **(facts | more))


def dimension(start: int | None = None, of: Any = None) -> Any:
    return SimpleNamespace(start=start, variable=of)


def unit(
    *variables: Any, version: str = "3.0", exchange: bool = False, outputs: Any = (), **simulation: Any
) -> Foreign:
    facts = {"canGetAndSetFMUstate": True, "canHandleVariableCommunicationStepSize": True} | simulation
    description = SimpleNamespace(
        fmiVersion=version, modelVariables=variables, outputs=outputs,
        coSimulation=None if exchange else SimpleNamespace(**facts),
        modelExchange=SimpleNamespace(canGetAndSetFMUstate=False) if exchange else None,
    )  # fmt: skip
    return Foreign(Path("x.fmu"), Path("."), "digest", description, _ports(Path("x.fmu"), description, {}))


# ---- ports ---------------------------------------------------------------------------------------------------------
def test_inputs_come_before_outputs_in_the_order_of_the_file() -> None:
    size = variable("n", "structuralParameter", "UInt64", 3)
    f = unit(
        variable("y", "output"), variable("b", start="0.5", unit="um", description="text"), size,
        variable("a", start="1 2 3", dimensions=[dimension(of=size)]), variable("p", "parameter"),
        variable("t", type_="String"), variable("c", clocks=["k"]),
        variable("m", "output", start="7", dimensions=[dimension(2), dimension(2)]),
    )  # fmt: skip
    assert [(p.name, p.kind, p.start, p.unit, p.text) for p in f.ports] == [
        ("b", "input", (0.5,), "um", "text"), ("a", "input", (1.0, 2.0, 3.0), "", ""),
        ("y", "output", (0.0,), "", ""), ("m", "output", (7.0,) * 4, "", ""),
    ]  # fmt: skip
    assert [p.size for p in f.ports] == [1, 3, 1, 4]
    assert f.ports[1].scalar_names == ("a_1", "a_2", "a_3")


def test_start_values_that_are_missing_are_zero_and_so_are_outputs_that_are_not_finite() -> None:
    outputs = [variable("a", "output", start="nan"), variable("b", "output", start="-inf")]
    f = unit(*outputs, variable("c", start=""), variable("d"), variable("e", start="inf"))
    assert {p.name: p.start for p in f.ports} == dict.fromkeys("abcd", (0.0,)) | {"e": (np.inf,)}


@pytest.mark.parametrize(
    ("kind", "start", "good"),
    [("Int8", "-128", -128.0), ("UInt64", str(2**64 - 1), 2**64 - 1), ("Boolean", "true", 1.0)]
    + [(k, x, None) for k, x in [("Int8", "128"), ("Int32", "0.5"), ("UInt8", "-1"), ("Boolean", "2")]],
)
def test_start_values_as_their_types(kind: str, start: str, good: float | None) -> None:
    if good is not None:
        assert unit(variable("a", type_=kind, start=start)).ports[0].start == (good,)
        return
    with pytest.raises(InputError, match=rf"x\.fmu: a: the start value must be a number of the type {kind}\. Got '"):
        unit(variable("a", type_=kind, start=start))


def test_too_many_elements_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_PORTS", 4)
    unit(variable("a", dimensions=[dimension(4)]))
    for variables, said in [
        ([variable("a", dimensions=[dimension(5)])], "x.fmu: 'a' has 5 elements; at most 4 can be connected"),
        ([variable("a", dimensions=[dimension(0)])], "x.fmu: 'a' has 0 elements; at most 4 can be connected"),
        ([variable(n, dimensions=[dimension(2)]) for n in "abc"], "x.fmu: more than 4 inputs and outputs"),
    ]:
        with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
            unit(*variables)


def test_how_it_can_be_called() -> None:
    real, whole = variable("a"), variable("b", type_="Int32")
    assert unit(real).direct
    assert unit(variable("a", type_="Real"), version="2.0").direct
    assert not unit(real, whole).direct
    assert not unit(real, version="1.0").direct
    assert not unit(real, exchange=True).direct
    assert [unit(real).saves, unit(real, canGetAndSetFMUstate=False).saves, unit(real, exchange=True).saves] == [
        True, False, False,
    ]  # fmt: skip
    assert unit(real, exchange=True).any_step
    assert not unit(real, version="1.0").any_step
    assert unit(real).any_step
    assert not unit(real, canHandleVariableCommunicationStepSize=False).any_step
    assert not unit(real, fixedInternalStepSize=0.1).any_step
    assert [unit(real, version=v).fmi for v in ("1.0", "2.0", "3.0")] == [1, 2, 3]


def test_declared_feed_through() -> None:
    a, b, y, z, w = variable("a"), variable("b"), *(variable(n, "output") for n in "yzw")
    told = [
        SimpleNamespace(variable=y, dependencies=[a, variable("state", "local")]),
        SimpleNamespace(variable=z, dependencies=None), SimpleNamespace(variable=w, dependencies=[]),
    ]  # fmt: skip
    assert unit(a, b, y, z, w, outputs=told).dependencies() == {"y": {"a"}, "z": {"a", "b"}, "w": set()}
    assert unit(a, y).dependencies() == {"y": {"a"}}


# ---- settings ------------------------------------------------------------------------------------------------------
N = variable("n", "structuralParameter", "UInt64", "2")
PARAMETERS = (
    variable("p", "parameter", start="1.5"), variable("i", "parameter", "Int32", "3"),
    variable("b", "parameter", "Boolean", "false"), variable("s", "parameter", "String", "text"),
    variable("x", "parameter", "Binary"), variable("v", "parameter", start="1 2", dimensions=[dimension(of=N)]),
    variable("w", "parameter", "Int32", "1 2", dimensions=[dimension(2)]), N,
    variable("u", start="0", dimensions=[dimension(of=N)]), variable("y", "output"),
)  # fmt: skip


@pytest.mark.parametrize(
    ("name", "value", "want"),
    [
        ("p", 2, 2.0), ("p", "*2", 3.0), ("p", "2.5", 2.5), ("i", 4, 4), ("i", "*2", 6), ("b", True, True),
        ("b", 0, False), ("b", 1, True), ("s", 3, "3"), ("v", [3, 4.5], [3.0, 4.5]), ("v", "*2", [2.0, 4.0]),
        ("i", 4.0, 4), ("w", [1, 2.0], [1, 2]), ("w", "*3", [3, 6]),
    ],
)  # fmt: skip
def test_a_value_of_a_parameter(name: str, value: Any, want: Any) -> None:
    found = unit(*PARAMETERS).with_settings({name: value}).settings[name]
    assert (found, type(found)) == (want, type(want))


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("q", 1, "no parameter 'q'; there are p, i, b, s, x, v, w, n"),
        ("u", 1, "no parameter 'u'; there are p, i, b, s, x, v, w, n"),
        ("p", "z", "p: must be a number or '*' and a number; got 'z'"),
        ("p", None, "p: must be a number or '*' and a number; got None"),
        ("p", "*z", "p: must be a number or '*' and a number; got '*z'"),
        ("i", 2.5, "i: must be a whole number; got 2.5"),
        ("b", 2, "b: must be true or false; got 2"),
        ("b", "true", "b: must be true or false; got 'true'"),
        ("x", 1, "x: a parameter of type Binary cannot be set in a scenario"),
        ("w", [1, 2.5], "w: must be a whole number; got 2.5"),
        ("i", 2**31, "i: 2.14748e+09 does not fit the type Int32"),
        ("i", float("inf"), "i: must be a whole number; got inf"),
        ("n", -1, "n: -1 does not fit the type UInt64"),
        ("s", "a\0b", "s: must have no NUL character; got 'a\\x00b'"),
        ("v", 1, "v: must be a list of numbers or '*' and a number; got 1"),
        ("v", ["a", 1], "v: must be a number or '*' and a number; got 'a'"),
        ("v", [1, 2, 3], "v: must have 2 elements; got 3"),
    ],
)
def test_a_value_that_does_not_fit(name: str, value: Any, said: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        unit(*PARAMETERS).with_settings({name: value})


def test_sizes_and_scaled_values_add_up() -> None:
    f = unit(*PARAMETERS)
    wide = f.with_settings({"n": 3, "v": [1.0, 2.0, 3.0]})
    assert [p.size for p in wide.ports if p.name == "u"] == [3]
    assert wide.with_settings({"v": "*2"}).settings == {"n": 3.0, "v": [2.0, 4.0, 6.0]}
    assert f.with_settings({"p": 2.0}).with_settings({"p": "*3"}).settings == {"p": 6.0}
    with pytest.raises(InputError, match=r"^v: must have 3 elements; got 2$"):
        f.with_settings({"v": [1.0, 2.0]}).with_settings({"n": 3})
    assert unit().with_settings({}).settings == {}
    with pytest.raises(InputError, match=r"^no parameter 'q'; there are none$"):
        unit().with_settings({"q": 1})


def test_a_token_follows_from_archive_and_settings() -> None:
    f = unit(*PARAMETERS)
    some = [f, f.with_settings({"p": 2.0}), f.with_settings({"i": 2.0}), f.with_settings({"p": 2.0, "i": 2.0})]
    assert len({x.token for x in some}) == 4
    assert some[3].token == f.with_settings({"i": 2.0}).with_settings({"p": 2.0}).token
    assert parameter_names(f) == {"p", "i", "b", "s", "x", "v", "w", "n"}
    assert start_values(f, "input") == [0.0, 0.0]
    assert first_outputs(f) == [0.0]


# ---- our own units -------------------------------------------------------------------------------------------------
@pytest.fixture
def graph() -> Graph:
    nodes = [
        Node("bank", "scaling", {"n": 3}, {"gain": [1.0, 2.0, 3.0]}), Node("late", "delay", {"n": 2}, {"y0": 0.5}),
        Node("ref", "reference", {}, {"shape": "sine"}),
    ]  # fmt: skip
    ends = [Input("u", ("bank.u",)), Input("v", ("late.u",), start=0.25)]
    return Graph(nodes, [], ends, [Output("y", "bank.y"), Output("w", "late.y"), Output("r", "ref.r")])


def test_names_and_starts_of_a_unit(graph: Graph) -> None:
    assert scalar_names(graph, "input") == ("u_1", "u_2", "u_3", "v")
    assert scalar_names(graph, "output") == ("y_1", "y_2", "y_3", "w", "r")
    assert start_values(graph, "input") == [0.0, 0.0, 0.0, 0.25]
    assert first_outputs(graph) == [0.0, 0.0, 0.0, 0.5, 0.0], "a delay knows its output"
    assert {"bank_gain", "bank_gain_2", "ref_shape"} <= parameter_names(graph)


def gains(g: Graph | Foreign) -> list[float]:
    assert isinstance(g, Graph)
    return g.nodes[0].value("gain").tolist()


@pytest.mark.parametrize(
    ("name", "value", "want"),
    [
        ("bank_gain", [4.0, 5.0, 6.0], [4.0, 5.0, 6.0]), ("bank_gain", "*2", [2.0, 4.0, 6.0]),
        ("bank_gain_2", 7, [1.0, 7.0, 3.0]), ("bank_gain_3", "*0.5", [1.0, 2.0, 1.5]),
    ],
)  # fmt: skip
def test_a_parameter_by_its_name(graph: Graph, name: str, value: Any, want: list[float]) -> None:
    assert gains(with_values(graph, {name: value})) == want
    assert gains(graph) == [1.0, 2.0, 3.0]
    port, first, values = changed(graph, name, value)
    assert port.name == "bank_gain"
    at = int(name[-1]) - 1 if name[-1].isdigit() else 0
    assert (first, values) == ((at, want[at : at + 1]) if name[-1].isdigit() else (0, want))


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("gain", 1.0, "no parameter 'gain'; there are bank_gain, bank_offset"),
        ("bank_gain", "*x", "bank_gain: after '*' stands a number; got '*x'"),
        ("bank_gain_2", "x", "bank_gain: one element takes one number; got 'x'"),
        ("bank_gain_2", [1.0], "bank_gain: one element takes one number; got [1.0]"),
        ("bank_gain_4", 1.0, "no parameter 'bank_gain_4'"),
    ],
)
def test_a_parameter_that_does_not_fit(graph: Graph, name: str, value: Any, said: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(said)}"):
        with_values(graph, {name: value})


def test_values_are_changed_one_after_the_other(graph: Graph) -> None:
    assert gains(with_values(graph, {"bank_gain": "*2", "bank_gain_1": "*3"})) == [6.0, 4.0, 6.0]
    shape = with_values(graph, {"ref_shape": "triangle"})
    assert isinstance(shape, Graph)
    assert np.ravel(shape.nodes[2].value("shape")).tolist() != np.ravel(graph.nodes[2].value("shape")).tolist()
