"""Algebraic loops by Newton's method from directional derivatives: closed forms, few sweeps, equal bits everywhere."""

import json
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from engines import ready, same
from scipy.optimize import brentq

import hystfmu as hy
from hystfmu.fmu.write.export import export_fmu
from hystfmu.scenario import simulate
from hystfmu.scenario.outcome.trace import Trace

H = 1e-3
SINE = {"block": "reference", "values": {"shape": "sine", "amplitude": 1.0, "frequency": 40.0, "phase": 0.3}}


def closed(unit: dict[str, Any], k: float, output: str = "y", **coupling: Any) -> dict[str, Any]:
    """The loop x = r + k z of a unit z = f(x); the unit reads first, so that z is a guess."""
    return {
        "name": "closed",
        "step": H,
        "stop": 0.05,
        "coupling": {"scheme": "iterative", **coupling},
        "order": ["reference", "x", "z"],
        "units": {"reference": SINE, "x": {"block": "sum", "values": {"k": [1.0, k]}, "as": "fmu3"}, "z": unit},
        "connections": {"x.u_1": "reference.r", "x.u_2": f"z.{output}", "z.u": "x.y"},
        "metrics": {"peak": {"kind": "peak", "signal": "x.y"}},
    }


def run(write: Any, data: dict[str, Any], newton: bool = True) -> Trace:
    """Run by every engine, by Newton's method or not."""
    system = ready(write(data))
    assert system.newton == newton
    return same(system)


def test_a_loop_in_which_sweeps_alone_diverge_needs_two(write: Any) -> None:
    """x = r - 6 x has the solution r/7; x <- r - 6 x leads away from it by a factor of 6 in every sweep."""
    trace = run(write, closed({"block": "sum", "dims": {"n": 1}, "values": {"k": [3.0]}}, -2.0))
    r = trace["reference.r"][1:]
    assert np.abs(trace["x.y"][1:] - r / 7).max() < 1e-15
    assert (trace.sweeps.all, trace.sweeps.most) == (2 * len(r), 2)


def test_several_values_at_once(write: Any) -> None:
    """x = r + A x with gains of both signs, against numpy; relaxation by one factor gives up."""
    A = np.array([[3.0, -1.0, 0.5], [0.4, -5.0, 1.0], [2.0, 0.3, 8.0]])
    data = closed({}, 0.0)
    names = [f"x{i}" for i in range(3)]
    data["units"] = {"reference": SINE}
    data["connections"] = {}
    for name, row in zip(names, A, strict=True):
        data["units"][name] = {"block": "sum", "dims": {"n": 4}, "values": {"k": [1.0, *row.tolist()]}}
        data["connections"] |= {f"{name}.u_{k + 2}": f"{other}.y" for k, other in enumerate(names)}
        data["connections"][f"{name}.u_1"] = "reference.r"
    data |= {"order": ["x2", "reference", "x0", "x1"], "metrics": {"peak": {"kind": "peak", "signal": "x0.y"}}}
    trace = run(write, data)
    r = trace["reference.r"][1:]
    want = np.linalg.solve(np.eye(3) - A, np.ones(3))
    for name, w in zip(names, want.tolist(), strict=True):
        assert np.abs(trace[f"{name}.y"][1:] - w * r).max() < 1e-13
    assert trace.sweeps.most <= 3


def test_a_curve_in_the_loop(write: Any) -> None:
    """x = r - 4 tanh(2 x), root by root."""
    net = {"W1": [2.0], "b1": [0.0], "W2": [1.0], "b2": [0.0], "activation": "tanh"}
    unit = {"block": "mlp", "dims": {"n_in": 1, "n_hidden": 1, "n_out": 1}, "values": net}
    data = closed(unit, -4.0)
    trace = run(write, data)
    want = [brentq(lambda x, r=r: x - r + 4 * np.tanh(2 * x), -2, 2, xtol=1e-15) for r in trace["reference.r"][1:]]
    assert np.abs(trace["x.y"][1:] - want).max() < 1e-12
    assert trace.sweeps.all / len(want) < 6  # by relaxation 8; the first step starts far off, where the curve is flat


@pytest.mark.parametrize("k", [-4.0, 0.7])
def test_a_memory_in_the_loop(write: Any, k: float) -> None:
    """x = r + k z of a play z(x) of radius 0.1, against bisection in numpy; each sweep starts from the same memory."""
    play = {"block": "backlash_sum", "dims": {"n": 1}, "values": {"w0": 0.0, "r": [0.1], "w": [1.0]}}
    trace = run(write, closed(play, k))
    z, want = trace["z.y"][0], []
    for r in trace["reference.r"][1:].tolist():

        def moved(x: float, z: float = z) -> float:
            return max(x - 0.1, min(x + 0.1, z))

        x = brentq(lambda x, r=r, moved=moved: x - r - k * moved(x), -20, 20, xtol=1e-14)
        z = moved(x)
        want.append(x)
    assert np.abs(trace["x.y"][1:] - want).max() < 1e-10
    assert trace.sweeps.all / len(want) < 3.5
    assert trace.sweeps.most <= 6


@pytest.mark.parametrize("hold", ["zero", "first"])
@pytest.mark.parametrize("substeps", [1, 3])
def test_dynamics_in_the_loop(write: Any, hold: str, substeps: int) -> None:
    """A lag does not feed through at an instant but follows within the step, with gain 9 here: z = a z + (1 - a) u."""
    tau, k = 2e-4, -9.0
    lag = {"b": [1.0], "a": [tau, 1.0], "hold": "zoh"}
    unit = {"block": "transfer_function", "dims": {"na": 1, "nb": 0}, "values": lag, "substeps": substeps, "hold": hold}
    trace = run(write, closed(unit, k))
    a = np.exp(-H / substeps / tau)
    z, last, want = 0.0, trace["x.y"][0], []
    for r in trace["reference.r"][1:].tolist():

        def end(x: float, z: float = z, last: float = last) -> float:
            for i in range(substeps):
                u = last + (x - last) * (i + 1) / substeps if hold == "first" else x
                z = a * z + (1 - a) * u
            return z

        x = brentq(lambda x, r=r, end=end: x - r - k * end(x), -20, 20, xtol=1e-15)
        z, last = end(x), x
        want.append(x)
    assert np.abs(trace["x.y"][1:] - want).max() < 1e-11
    assert trace.sweeps.most <= 3


def test_an_event_in_a_step_of_the_loop(write: Any) -> None:
    """The lag again, under a discontinuity between two steps: each piece of the step is a loop of its own."""
    tau, k, at = 2e-4, -9.0, 0.0123
    lag = {"block": "transfer_function", "dims": {"na": 1, "nb": 0}, "values": {"b": [1.0], "a": [tau, 1.0]}}
    data = closed(lag, k)
    data["units"]["reference"] = {"block": "disturbance", "values": {"step": 1.0, "t_step": at, "amplitude": 0.0}}
    data["connections"]["x.u_1"] = "reference.d"
    trace = run(write, data)
    z, want = 0.0, [0.0]
    for t in trace.t[1:].tolist():
        for end in (at, t) if t - H < at < t else (t,):
            d, a = float(end > at), np.exp(-(end - (at if end - H < at < end else t - H)) / tau)
            z = (a * z + (1 - a) * d) / (1 - (1 - a) * k)
        want.append(z)
    assert np.abs(trace["z.y"] - want).max() < 1e-6  # 2e-9 of the time, over tau/10
    assert trace.sweeps.steps == len(want) - 1 + 2


def test_a_unit_that_reads_itself(write: Any) -> None:
    """x = r - 4 x in one unit; held instead of solved it is x_n = r_n - 4 x_(n-1)."""
    data = closed({}, -4.0)
    del data["units"]["z"]
    data |= {"order": ["reference", "x"], "connections": {"x.u_1": "reference.r", "x.u_2": "x.y"}}
    trace = run(write, data)
    assert np.abs(trace["x.y"] - trace["reference.r"] / 5)[1:].max() < 1e-15
    data |= {"stop": 0.005, "coupling": {"scheme": "gauss_seidel"}}
    trace = run(write, data, newton=False)
    assert np.array_equal(trace["x.y"][1:], trace["reference.r"][1:] - 4 * trace["x.y"][:-1])


def test_units_of_several_rates(write: Any) -> None:
    """The gain reads every third step only: in between its output is a number, and x = r + k z."""
    data = closed({"block": "sum", "dims": {"n": 1}, "values": {"k": [3.0]}, "every": 3}, -2.0)
    trace = run(write, data)
    r, z = trace["reference.r"], trace["z.y"]
    assert np.abs(trace["x.y"][3::3] - r[3::3] / 7).max() < 1e-15
    assert np.array_equal(z[4::3], z[3:-1:3])
    assert np.abs(trace["x.y"] - (r - 2 * z))[1:].max() < 1e-15


def test_samples_answer_in_steps_and_not_in_derivatives(write: Any) -> None:
    """With a sampled unit in the loop sweeps are relaxed, to the same result; beside the loop it does no harm."""
    gain = {"block": "pid", "values": {"Kp": 3.0, "Ki": 0.0, "Kd": 0.0}, "inputs": {"y": 0.0, "u_ff": 0.0}}
    data = closed(gain, -2.0, "u")
    data["connections"]["z.y_d"] = data["connections"].pop("z.u")
    trace = run(write, data, newton=False)
    assert np.abs(trace["x.y"][1:] - trace["reference.r"][1:] / 7).max() < 1e-12
    assert trace.sweeps.most == 3
    data = closed({"block": "sum", "dims": {"n": 1}, "values": {"k": [3.0]}}, -2.0)
    data["units"]["delay"] = {"block": "delay"}
    data["order"].append("delay")
    data["connections"]["delay.u"] = "x.y"
    assert run(write, data).sweeps.most == 2


@pytest.mark.turn("foreign units")
@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("fmi", "offers"),
    [(2, False), *(pytest.param(*c, marks=pytest.mark.stress) for c in ((3, False), (2, True), (3, True)))],
)
def test_an_fmu_of_others(write: Any, tmp_path: Path, fmi: Literal[2, 3], offers: bool) -> None:
    """With derivatives as ours; one that has none is relaxed."""
    data = closed({"block": "sum", "dims": {"n": 1}, "values": {"k": [3.0]}}, -2.0)
    if not offers:
        data["units"]["z"] = {"block": "pid", "values": {"Kp": 3.0, "Ki": 0.0, "Kd": 0.0}}
        data["units"]["z"]["inputs"] = {"y": 0.0, "u_ff": 0.0}
        data["connections"] = {"x.u_1": "reference.r", "x.u_2": "z.u", "z.y_d": "x.y"}
    own = ready(write(data))
    want = simulate(own, "native")
    export_fmu(own.parts[2].own, tmp_path / "scenarios" / "z.fmu", fmi=fmi)
    data["units"]["z"] = {"fmu": "../z.fmu"}
    foreign = ready(write(data))
    assert foreign.newton == offers
    for engine in ("fmpy", "native"):
        trace = simulate(foreign, engine)  # type: ignore[arg-type]
        assert trace.values.tobytes() == want.values.tobytes()
        assert (trace.sweeps.all, trace.sweeps.most) == (want.sweeps.all, want.sweeps.most)


def test_the_report_counts_sweeps(write: Any, tmp_path: Path) -> None:
    data = closed({"block": "sum", "dims": {"n": 1}, "values": {"k": [3.0]}}, -2.0)
    (result,) = hy.run([write(data)], engine="native", report=tmp_path / "report")
    assert result.summary()["sweeps"] == {"method": "newton", "mean": 2.0, "most": 2}
    (entry,) = json.loads((tmp_path / "report" / "report.json").read_text())["results"]
    assert entry["sweeps"] == result.summary()["sweeps"]
    assert "2 sweeps per step, at most 2 (Newton)" in (tmp_path / "report" / "report.html").read_text()
    (other,) = hy.run([write(data)], engine="native", coupling="jacobi")
    assert "sweeps" not in other.summary()
