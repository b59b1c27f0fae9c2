"""Foreign FMUs that are not called directly, as units of a scenario: the same bits in every engine and coupling."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from engines import ready
from reference_fmus import reference_fmu
from test_fmu_alone import exchange_only

from hystfmu.base.errors import InputError
from hystfmu.fmu import export_fmu
from hystfmu.graph import Graph, Node
from hystfmu.scenario import simulate
from hystfmu.scenario.engine.simulation import ENGINES
from hystfmu.scenario.outcome.trace import Stopped, Trace


def in_all_engines(folder: Path) -> Trace:
    """Run a scenario by every engine and return what all of them give."""
    first, *others = (simulate(ready(folder), engine) for engine in ENGINES)
    for other in others:
        assert {k: other[k].tobytes() for k in first.columns} == {k: first[k].tobytes() for k in first.columns}
    return first


# each scheme and each hold once
SOON = [("gauss_seidel", "first"), ("iterative", "zero")]
LONG = [(s, h) for s in ("gauss_seidel", "jacobi", "iterative") for h in ("zero", "first") if (s, h) not in SOON]


@pytest.mark.parametrize(("scheme", "hold"), [*SOON, *(pytest.param(*c, marks=pytest.mark.stress) for c in LONG)])
def test_model_exchange_in_a_closed_loop(loop: Any, write: Any, scheme: str, hold: str) -> None:
    """The second-order dynamics of the plant as a foreign FMU that has Model Exchange only."""
    loop["stop"], loop["coupling"] = 0.005, {"scheme": scheme}
    del loop["metrics"]["tracking"]["after"]
    omega = 2 * np.pi * 500
    values = {"b": [omega**2], "a": [1.0, 1.4 * omega, omega**2]}
    loop["units"]["plant"]["graph"] = {
        "blocks": [{"name": "hysteresis", "type": "backlash_sum", "values": {"w0": 0.3, "r": [0.1], "w": [0.3]}}],
        "inputs": [{"name": "u", "to": ["hysteresis.u"]}],
        "outputs": [{"name": "v", "source": "hysteresis.y"}],
    }
    loop["units"]["g0"] = {"block": "transfer_function", "dims": {"na": 2, "nb": 0}, "values": values}
    loop["units"]["g0"] |= {"substeps": 2, "hold": hold}
    loop["order"] = ["plant", "g0", "reference", "pid"]
    loop["connections"] |= {"g0.u": "plant.v", "pid.y": "g0.y"}
    loop["record"], loop["loops"] = ["g0.y"], []
    loop["metrics"]["tracking"]["signal"] = "g0.y"
    want = simulate(ready(write(loop)), "native")["g0.y"]
    node = Node("g0", "transfer_function", {"na": 2, "nb": 0}, values)
    folder = write(loop)
    export_fmu(Graph.single(node).with_step(1e-4), folder / "both.fmu")
    exchange_only(folder / "both.fmu", folder / "g0.fmu")
    loop["units"]["g0"] = {"fmu": "g0.fmu", "substeps": 2, "hold": hold}
    got = in_all_engines(write(loop))["g0.y"]
    assert np.abs(want).max() > 0.05
    assert np.abs(got - want).max() < 1e-7  # ours integrates exactly


def feedthrough(loop: Any, write: Any, name: str) -> Path:
    """A scenario in which a reference drives an input of Feedthrough."""
    folder = write(loop)
    (folder / "x.fmu").write_bytes(reference_fmu("fmi3/Feedthrough").read_bytes())
    loop["units"]["x"] = {"fmu": "x.fmu"}
    loop["order"].append("x")
    loop["connections"][f"x.{name}_input"] = "reference.r"
    loop["units"]["reference"]["values"]["amplitude"] = 3.0
    loop["stop"] = 0.02
    return Path(write(loop))


def test_whole_numbers_are_the_nearest(loop: Any, write: Any) -> None:
    trace = in_all_engines(feedthrough(loop, write, "Int16"))
    assert trace["x.Int16_output"].tolist() == np.round(trace["reference.r"]).tolist()
    assert set(trace["x.Int16_output"]) == {-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0}


def test_a_boolean_is_true_from_one_half_on(loop: Any, write: Any) -> None:
    trace = in_all_engines(feedthrough(loop, write, "Boolean"))
    assert trace["x.Boolean_output"].tolist() == (trace["reference.r"] >= 0.5).astype(float).tolist()


@pytest.mark.parametrize("engine", ENGINES)
def test_a_number_that_does_not_fit_stops_the_run(loop: Any, write: Any, engine: Any) -> None:
    folder = feedthrough(loop, write, "UInt8")
    with pytest.raises(Stopped, match=r"x refuses the step from t = 0.0\d+ s: UInt8_input: -0.\d+ does not fit the"):
        simulate(ready(folder), engine)


def test_sizes_that_a_scenario_sets(loop: Any, write: Any) -> None:
    folder = write(loop)
    (folder / "x.fmu").write_bytes(reference_fmu("fmi3/StateSpace").read_bytes())
    sizes = {"m": 1, "n": 1, "r": 1}
    loop["units"]["x"] = {"fmu": "x.fmu", "set": sizes | {"A": [0.0], "B": [0.0], "C": [0.0], "D": [2.0]}}
    loop["order"].append("x")
    loop["connections"]["x.u"] = "reference.r"
    trace = in_all_engines(write(loop))
    assert trace["x.y"].tolist() == (2 * trace["reference.r"]).tolist()
    loop["units"]["x"]["set"]["D"] = [2.0, 1.0]
    with pytest.raises(InputError, match=r"units\.x: D: must have 1 elements; got 2"):
        ready(write(loop))


def test_fmi_1_in_both_engines(loop: Any, write: Any) -> None:
    folder = write(loop)
    (folder / "x.fmu").write_bytes(reference_fmu("fmi1cs/Dahlquist").read_bytes())
    loop["units"]["x"] = {"fmu": "x.fmu", "set": {"k": "*2"}}
    loop["order"].append("x")
    loop["step"], loop["stop"] = 0.1, 1.0
    del loop["metrics"]["tracking"]["after"]
    assert np.abs(in_all_engines(write(loop))["x.x"] - 0.8 ** np.arange(11)).max() < 1e-14
    loop["coupling"] = {"scheme": "iterative"}
    with pytest.raises(Stopped, match="x: iterative coupling needs an FMU that can get and set its state"):
        simulate(ready(write(loop)))


@pytest.mark.parametrize("engine", ENGINES)
def test_an_adapted_fmu_is_never_asked_for_tangents(loop: Any, write: Any, engine: Any) -> None:
    """Set by types, it is called by no function for a tangent: a loop through it is solved by relaxation."""
    folder = write(loop)
    (folder / "x.fmu").write_bytes(reference_fmu("fmi3/Feedthrough").read_bytes())
    loop["units"]["x"] = {"fmu": "x.fmu", "set": {}}
    loop["units"]["sum"] = {"block": "sum", "dims": {"n": 2}, "values": {"k": [1.0, -0.5]}}
    loop["order"] += ["x", "sum"]
    loop["connections"] |= {"sum.u_1": "reference.r", "sum.u_2": "x.Float64_continuous_output"}
    loop["connections"]["x.Float64_continuous_input"] = "sum.y"
    loop["stop"], loop["coupling"] = 0.005, {"scheme": "iterative"}
    del loop["metrics"]["tracking"]["after"]
    system = ready(write(loop))
    assert (system.parts[3].has_tangent, system.newton) == (False, False)
    trace = simulate(system, engine)
    assert trace["x.Float64_continuous_output"] == pytest.approx(trace["reference.r"] / 1.5, abs=1e-8)
    assert trace["x.Float64_continuous_output"] == pytest.approx(trace["sum.y"], abs=1e-8)


def test_final_states_of_a_foreign_fmu_are_refused_in_one_line(loop: Any, write: Any) -> None:
    folder = feedthrough(loop, write, "Boolean")
    loop["final_states"] = True
    write(loop)
    with pytest.raises(
        InputError, match=r"scenario\.toml: final_states: x is a foreign FMU, whose states are not known$"
    ):
        ready(folder)
