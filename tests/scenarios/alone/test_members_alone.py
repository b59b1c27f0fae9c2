"""Units as foreign FMUs in this process, in both engines: the bits of the same units as graphs in every coupling.

Small loops of a few steps: a lag of FMI 2.0 or 3.0 under a law, and a pair of gains whose second input is a constant.
"""

from __future__ import annotations

import copy
import json
import pickle
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from engines import ready
from reference_fmus import reference_fmu

from hystfmu.fmu.foreign.instance import Finding
from hystfmu.fmu.write.export import export_fmu
from hystfmu.graph import Graph, Node
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.engine.simulation import ENDED, ENGINES, TASK, chunks_here, main
from hystfmu.scenario.outcome.trace import Stopped, Trace
from hystfmu.scenario.system.system import System

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


@pytest.fixture(autouse=True)
def cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    folder = tmp_path_factory.getbasetemp() / "cache_of_members"
    monkeypatch.setenv("HYSTFMU_CACHE", str(folder))
    return


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


@pytest.mark.parametrize("as_", ["fmu2", "fmu3"])
@pytest.mark.parametrize("more", [{}, {"substeps": 2, "hold": "first"}])
@pytest.mark.parametrize("scheme", ["gauss_seidel", "jacobi", "iterative"])
def test_our_unit_as_an_fmu_has_the_bits_of_the_core(write: Any, as_: str, more: Any, scheme: str) -> None:
    unit = {"fmu2": "lag", "fmu3": "pair"}[as_]
    system = ready(write(loop(unit, scheme, {"as": as_} | more) | {"final_states": True}))
    want, found = Native(system).run(), run(system, "fmpy")
    assert found.values.tobytes() == want.values.tobytes()
    assert found.final_states == want.final_states
    assert set(want.final_states) == {"unit", "reference", "law"}


def test_units_at_several_rates(write: Any, fmus: Path) -> None:
    data = loop("lag", "gauss_seidel", {"fine": True})
    data["ripple"], data["units"]["law"]["every"] = 3, 2
    data["stop"] = 8 * H
    want = Native(ready(write(data))).run()
    system = foreign(data, write, fmus, "lag", 3)
    assert [p.period for p in system.parts] == [1, 3, 6]
    for engine in ENGINES:
        assert run(system, engine).values.tobytes() == want.values.tobytes(), engine
    held = want["law.y"].reshape(-1)[1:]
    assert all(len(set(held[k : k + 5].tolist())) == 1 for k in range(5, len(held) - 5, 6))


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


def test_what_is_not_finite_or_refused_stops_the_run(write: Any, fmus: Path) -> None:
    data = loop("lag", "gauss_seidel", {})
    data["units"]["law"]["values"]["k"] = [1e308, 1e308]
    system = foreign(data, write, fmus, "lag", 3)
    for engine in ENGINES:
        with pytest.raises(
            Stopped, match=r"^(values that are not finite at t = |unit refuses the step from t = )0\.\d+ s"
        ):
            run(system, engine)


@pytest.mark.parametrize("fmi", [2, 3])
def test_values_that_an_fmu_does_not_take_at_first(write: Any, fmus: Path, fmi: int) -> None:
    system = foreign(loop("lag", "gauss_seidel", {}), write, fmus, "lag", fmi)
    for engine in ENGINES:
        with pytest.raises(Stopped, match=r"^unit .*"):
            run(replace(system, begins=(float("nan"),) * system.n_values), engine)


# ---- adapted -------------------------------------------------------------------------------------------------------
def feedthrough(write: Any, scheme: str, more: dict[str, Any], kind: str = "Float64_continuous") -> System:
    data = loop("lag", scheme, {})
    data["units"]["unit"] = {"fmu": "x.fmu"} | more
    data["connections"] = {
        f"unit.{kind}_input": "law.y", "law.u_1": "reference.r", "law.u_2": f"unit.{kind}_output",
    }  # fmt: skip
    folder = write(data, "adapted")
    (folder / "x.fmu").write_bytes(reference_fmu("fmi3/Feedthrough").read_bytes())
    return ready(folder)


@pytest.mark.parametrize("scheme", ["gauss_seidel", "jacobi", "iterative"])
@pytest.mark.parametrize("more", [{}, {"substeps": 2, "hold": "first"}])
def test_an_fmu_set_by_types_is_a_wire(write: Any, scheme: str, more: dict[str, Any]) -> None:
    """Feedthrough returns its input: the law reads its own last value, or agrees with it."""
    system = feedthrough(write, scheme, more)
    assert not system.parts[0].graph.direct  # type: ignore[union-attr]
    one, other = (run(system, engine) for engine in ENGINES)
    assert one.values.tobytes() == other.values.tobytes()
    assert one.sweeps == other.sweeps
    y, law, r = (one[f"{n}"] for n in ("unit.Float64_continuous_output", "law.y", "reference.r"))
    if scheme == "iterative":
        assert y[1:] == pytest.approx(r[1:] / 1.7, abs=1e-7)
    elif not more:
        assert y[1:].tolist() == law[:-1].tolist()
    if scheme == "gauss_seidel":
        assert law == pytest.approx(r - 0.7 * y, abs=1e-12)


def test_an_fmu_of_another_version_steps_by_its_own_rule(write: Any) -> None:
    """Dahlquist of FMI 1.0 makes Euler steps of 0.1 s: x = 0.9^k."""
    data = loop("lag", "gauss_seidel", {}) | {"step": 0.1, "stop": 0.5}
    data["units"]["unit"] = {"fmu": "x.fmu"}
    data["connections"] = {"law.u_1": "reference.r", "law.u_2": "unit.x"}
    folder = write(data, "adapted")
    (folder / "x.fmu").write_bytes(reference_fmu("fmi1cs/Dahlquist").read_bytes())
    for engine in ENGINES:
        assert run(ready(folder), engine)["unit.x"] == pytest.approx(0.9 ** np.arange(6), rel=1e-13), engine


@pytest.mark.parametrize(("kind", "f"), [("Int32", np.round), ("Boolean", lambda x: (x >= 0.5).astype(float))])
def test_an_input_of_another_type(write: Any, kind: str, f: Any) -> None:
    system = feedthrough(write, "gauss_seidel", {}, kind)
    for engine in ENGINES:
        found = run(system, engine)
        assert found[f"unit.{kind}_output"][1:].tolist() == f(found["law.y"][:-1]).tolist()


@pytest.mark.parametrize("engine", ENGINES)
def test_without_saved_states_there_is_no_iteration(write: Any, engine: Any) -> None:
    data = loop("lag", "iterative", {})
    data["units"]["unit"] = {"fmu": "x.fmu"}
    data["connections"] = {"law.u_1": "reference.r", "law.u_2": "unit.x"}
    folder = write(data, "adapted")
    (folder / "x.fmu").write_bytes(reference_fmu("fmi1cs/Dahlquist").read_bytes())
    with pytest.raises(Stopped, match=r"^unit: iterative coupling needs an FMU that can get and set its state$"):
        run(ready(folder), engine)


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
