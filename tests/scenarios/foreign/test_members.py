"""What a scenario reads of a foreign FMU, and units as members of a run: the bits of the core."""

import copy
import json
import pickle
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from engines import ready

from hystfmu import Graph, Input, InputError, Node, Output
from hystfmu.fmu.foreign.instance import Finding
from hystfmu.fmu.write.export import export_fmu
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.engine.simulation import ENDED, ENGINES, TASK, chunks_here, main
from hystfmu.scenario.outcome.trace import Stopped, Trace
from hystfmu.scenario.system import foreign as module
from hystfmu.scenario.system.case import first_outputs, parameter_names, start_values, with_values
from hystfmu.scenario.system.foreign import Foreign, _ports
from hystfmu.scenario.system.system import System


def variable(name: str, causality: str = "input", type_: str = "Float64", start: Any = None, **more: Any) -> Any:
    facts = {"dimensions": [], "unit": None, "description": None, "clocks": None}
    facts |= {"variability": "continuous", "declaredType": None}
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


# ---- settings ------------------------------------------------------------------------------------------------------
N = variable("n", "structuralParameter", "UInt64", "2")
PARAMETERS = (
    variable("p", "parameter", start="1.5"), variable("i", "parameter", "Int32", "3"),
    variable("b", "parameter", "Boolean", "false"), variable("s", "parameter", "String", "text"),
    variable("x", "parameter", "Binary"), variable("v", "parameter", start="1 2", dimensions=[dimension(of=N)]),
    variable("w", "parameter", "Int64", "1 2", dimensions=[dimension(2)]), N,
    variable("u", start="0", dimensions=[dimension(of=N)]), variable("y", "output"),
)  # fmt: skip


@pytest.mark.parametrize(("name", "value", "want"), [
    ("p", 2, 2.0), ("p", "*2", 3.0), ("p", "2.5", 2.5), ("i", 4, 4), ("i", "*2", 6), ("b", True, True),
    ("b", 0, False), ("b", 1, True), ("s", 3, "3"), ("v", [3, 4.5], [3.0, 4.5]), ("v", "*2", [2.0, 4.0]),
    ("i", 4.0, 4), ("w", [1, 2.0], [1, 2]), ("w", "*3", [3, 6]),
    ("w", [2**53 + 1, True], [2**53 + 1, 1]), ("p", True, 1.0),
])  # fmt: skip
def test_a_value_of_a_parameter(name: str, value: Any, want: Any) -> None:
    found = unit(*PARAMETERS).with_settings({name: value}).settings[name]
    assert (found, type(found)) == (want, type(want))


@pytest.mark.parametrize(("name", "value", "said"), [
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
])  # fmt: skip
def test_a_value_that_does_not_fit(name: str, value: Any, said: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        unit(*PARAMETERS).with_settings({name: value})


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


def gains(g: Graph | Foreign) -> list[float]:
    assert isinstance(g, Graph)
    return g.nodes[0].value("gain").tolist()


@pytest.mark.parametrize(("name", "value", "said"), [
    ("gain", 1.0, "no parameter 'gain'; there are bank_gain, bank_offset"),
    ("bank_gain", "*x", "bank_gain: '*' must be followed by a number; got '*x'"),
    ("bank_gain_2", "x", "bank_gain: one element must have one number; got 'x'"),
    ("bank_gain_2", [1.0], "bank_gain: one element must have one number; got [1.0]"),
    ("bank_gain_4", 1.0, "no parameter 'bank_gain_4'"),
])  # fmt: skip
def test_a_parameter_that_does_not_fit(graph: Graph, name: str, value: Any, said: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(said)}"):
        with_values(graph, {name: value})


def test_values_are_changed_one_after_the_other(graph: Graph) -> None:
    assert gains(with_values(graph, {"bank_gain": "*2", "bank_gain_1": "*3"})) == [6.0, 4.0, 6.0]
    shape = with_values(graph, {"ref_shape": "triangle"})
    assert isinstance(shape, Graph)
    assert np.ravel(shape.nodes[2].value("shape")).tolist() != np.ravel(graph.nodes[2].value("shape")).tolist()


# ---- in a run --------------------------------------------------------------------------------------------------------
H = 2.0**-7
LAG = {"b": [1.0], "a": [0.03, 1.0]}
PAIR = {"gain": [2.0, -3.0], "offset": [0.5, 0.25]}
NODES = {
    "lag": Node("lag", "transfer_function", {"na": 1, "nb": 0}, LAG),
    "pair": Node("pair", "scaling", {"n": 2}, PAIR),
}
STEP = {"block": "reference", "values": {"shape": "steps", "T": 2.3 * H, "levels": [1.0, -0.5]}, "dims": {"m": 2}}


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fmus")
    for name, node in NODES.items():
        for fmi in (2, 3):
            export_fmu(Graph.single(node).with_step(H), folder / f"{name}{fmi}.fmu", fmi=fmi)  # type: ignore[arg-type]
    return folder


def own(name: str) -> dict[str, Any]:
    node = NODES[name]
    values = {k: np.ravel(v).tolist() for k, v in node.values.items()}
    return {"block": node.type, "dims": dict(node.dims), "values": values}


def loop(unit: str, scheme: str, more: dict[str, Any], events: str = "grid") -> dict[str, Any]:
    """The unit stands before the law that drives it by r - 0.7 y."""
    law = {"block": "sum", "dims": {"n": 2}, "values": {"k": [1.0, -0.7 if unit == "lag" else -0.1]}}
    into, out = ("u", "y") if unit == "lag" else ("u_1", "y_1")
    given = {} if unit == "lag" else {"inputs": {"u_2": 0.75}}
    return {
        "name": "members", "step": H, "stop": 7 * H, "order": ["unit", "reference", "law"],
        "coupling": {"scheme": scheme, "events": events},
        "units": {"unit": own(unit) | given | more, "reference": STEP, "law": law},
        "connections": {"unit." + into: "law.y", "law.u_1": "reference.r", "law.u_2": "unit." + out},
        "metrics": {"p": {"kind": "peak", "signal": "law.y"}},
    }  # fmt: skip


def foreign(data: dict[str, Any], write: Any, fmus: Path, unit: str, fmi: int) -> System:
    """The same scenario with the unit as a foreign FMU."""
    data = copy.deepcopy(data)
    kept = {k: v for k, v in data["units"]["unit"].items() if k not in ("block", "dims", "values")}
    data["units"]["unit"] = {"fmu": "unit.fmu"} | kept
    folder = write(data, "foreign")
    (folder / "unit.fmu").write_bytes((fmus / f"{unit}{fmi}.fmu").read_bytes())
    return ready(folder)


def run(system: System, engine: Any) -> Trace:
    return Trace.joined(chunks_here(system, engine), system.n_steps + 1)


@pytest.mark.some(8)
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("unit", ["lag", "pair"])
@pytest.mark.parametrize("scheme", ["gauss_seidel", "jacobi", "iterative"])
@pytest.mark.parametrize("more", [{}, {"substeps": 3}, {"substeps": 2, "hold": "first"}])
def test_a_foreign_unit_has_the_bits_of_ours(
    write: Any, fmus: Path, unit: str, scheme: str, more: dict[str, Any], fmi: int
) -> None:
    data = loop(unit, scheme, more, "located" if unit == "lag" else "grid")
    ours = ready(write(data))
    want = Native(ours).run()
    system = foreign(data, write, fmus, unit, fmi)
    assert [p.name for p in system.foreign] == ["unit"]
    assert system.newton == ours.newton == (scheme == "iterative")
    for engine in ENGINES:
        found = run(system, engine)
        assert found.columns.keys() == want.columns.keys()
        for end in want.columns:
            assert found[end].tobytes() == want[end].tobytes(), (engine, end)
        assert found.sweeps == want.sweeps
    assert len(set(want["law.y"].tolist())) > 3


@pytest.mark.parametrize("fmi", [2, 3])
def test_parameters_of_a_foreign_unit(write: Any, fmus: Path, fmi: int) -> None:
    """Set in the scenario, scaled, and set anew between runs of the core."""
    data = loop("pair", "gauss_seidel", {})
    system = foreign(data, write, fmus, "pair", fmi)
    name, other = ("gain_1", "gain_2") if fmi == 2 else ("gain", "offset")
    value: Any = 4.0 if fmi == 2 else [4.0, -3.0]
    data["units"]["unit"]["values"]["gain"][0] = 4.0
    want = Native(ready(write(data))).run()
    again = Native(system)
    plain = again.run().values.tobytes()
    again.set({f"unit.{name}": value})
    assert again.run().values.tobytes() == want.values.tobytes()
    again.set({})
    assert again.run().values.tobytes() == plain
    data["units"]["unit"] |= {"set": {name: value}}
    del data["units"]["unit"]["values"]
    changed = foreign(data, write, fmus, "pair", fmi)
    for engine in ENGINES:
        assert run(changed, engine).values.tobytes() == want.values.tobytes()
    assert other in system.parameters or f"unit.{other}" in system.parameters


@pytest.mark.parametrize("fmi", [2, 3])
def test_values_that_an_fmu_does_not_take_at_first(write: Any, fmus: Path, fmi: int) -> None:
    system = foreign(loop("lag", "gauss_seidel", {}), write, fmus, "lag", fmi)
    for engine in ENGINES:
        with pytest.raises(Stopped, match=r"^unit .*"):
            run(replace(system, begins=(float("nan"),) * system.n_values), engine)


# ---- in a child ----------------------------------------------------------------------------------------------------
def failing(task: Any, file: Any) -> dict[str, Any]:
    raise task


def test_every_end_of_a_child_has_a_reason(tmp_path: Path) -> None:
    for error, why, status in [
        (MemoryError(), "needs more than 1.07374e+09 GB of memory", "memory"),
        (Stopped("a\n b"), "a b", "stopped"),
        (Finding("why"), "why", "stopped"),
        (ValueError("x"), "ValueError: x", "stopped"),
    ]:
        (tmp_path / TASK).write_bytes(pickle.dumps((failing, error, 2.0**30)))
        main(str(tmp_path))
        assert json.loads((tmp_path / ENDED).read_text()) == {"stopped": why, "status": status}
