"""Substeps and first-order hold, compared with closed forms, the same bits in every engine; delays; missed events."""

from typing import Any

import numpy as np
import pytest
from engines import ready, same

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.scenario import Cases, build, simulate, to_graph
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.report.loops import delay_budget
from hystfmu.scenario.report.terminal import verdicts

H, TAU = 1e-3, 5e-3


def ramp(order: list[str], scheme: str = "gauss_seidel", **unit: Any) -> dict[str, Any]:
    """A lag y' = (u - y)/tau behind a reference that rises in a line; exact for inputs constant in a substep."""
    wave = {"shape": "triangle", "amplitude": 1.0, "frequency": 2.0}
    lag = {"b": [1.0], "a": [TAU, 1.0], "hold": "zoh"}
    return {
        "name": "ramp",
        "step": H,
        "stop": 0.02,
        "coupling": {"scheme": scheme},
        "order": order,
        "units": {
            "reference": {"block": "reference", "values": wave},
            "lag": {"block": "transfer_function", "dims": {"na": 1, "nb": 0}, "values": lag, **unit},
        },
        "connections": {"lag.u": "reference.r"},
        "metrics": {"peak": {"kind": "peak", "signal": "lag.y"}},
    }


def run(write: Any, data: dict[str, Any]) -> Trace:
    """Run by every engine, as FMI 2.0 and 3.0."""
    systems = []
    for kind in ("fmu2", "fmu3"):
        for unit in data["units"].values():
            unit["as"] = kind
        systems.append(ready(write(data)))
    return same(*systems)


def held(trace: Trace, substeps: int, inputs: Any) -> np.ndarray:
    """The lag with a constant input in each substep, in closed form; inputs(n, i) is that of substep i of step n."""
    keep, y = np.exp(-H / substeps / TAU), [trace["lag.y"][0]]
    for n in range(1, len(trace.t)):
        now = y[-1]
        for i in range(substeps):
            now = keep * now + (1 - keep) * inputs(n, i)
        y.append(now)
    return np.array(y)


@pytest.mark.some(4)
@pytest.mark.parametrize("scheme", ["gauss_seidel", "jacobi", "iterative"])
@pytest.mark.parametrize("substeps", [1, 3, 10])
def test_substeps_hold_the_input_of_the_step(write: Any, scheme: str, substeps: int) -> None:
    trace = run(write, ramp(["reference", "lag"], scheme, substeps=substeps))
    late = int(scheme == "jacobi")
    want = held(trace, substeps, lambda n, i: trace["reference.r"][n - late])
    assert np.ptp(trace["lag.y"]) > 0.05
    assert np.abs(trace["lag.y"] - want).max() < 1e-13


@pytest.mark.parametrize("substeps", [1, 4])
def test_the_line_goes_to_the_value_at_the_end_when_it_is_known(write: Any, substeps: int) -> None:
    trace = run(write, ramp(["reference", "lag"], substeps=substeps, hold="first"))
    r = trace["reference.r"]
    want = held(trace, substeps, lambda n, i: r[n - 1] + (r[n] - r[n - 1]) * (i + 1) / substeps)
    assert np.abs(trace["lag.y"] - want).max() < 1e-13


@pytest.mark.parametrize(
    ("order", "scheme"), [(["lag", "reference"], "gauss_seidel"), (["reference", "lag"], "jacobi")]
)
@pytest.mark.parametrize("substeps", [1, 4])
def test_the_line_is_continued_when_it_is_not(write: Any, order: list[str], scheme: str, substeps: int) -> None:
    trace = run(write, ramp(order, scheme, substeps=substeps, hold="first"))
    r = np.concatenate([trace["reference.r"][:1], trace["reference.r"]])  # flat before the beginning
    want = held(trace, substeps, lambda n, i: r[n] + (r[n] - r[n - 1]) * (i + 1) / substeps)
    assert np.abs(trace["lag.y"] - want).max() < 1e-13


def test_many_substeps_on_a_line_are_the_lag_of_a_ramp(write: Any) -> None:
    """y' = (u - y)/tau for u = s t: y = s (t - tau (1 - exp(-t/tau))); held inputs are half a step wrong, lines not."""
    error = {}
    for hold in ("zero", "first"):
        trace = run(write, ramp(["reference", "lag"], substeps=200, hold=hold))
        slope = (trace["reference.r"][2] - trace["reference.r"][1]) / H
        start = trace["reference.r"][0]
        exact = start + slope * (trace.t - TAU * (1 - np.exp(-trace.t / TAU)))
        exact += (trace["lag.y"][0] - start) * np.exp(-trace.t / TAU)
        error[hold] = np.abs(trace["lag.y"] - exact).max()
    assert error["first"] < error["zero"] / 50


def test_a_source_that_steps_more_often_and_comes_later(write: Any) -> None:
    """Its newest value lies one of its own steps before the end: the line is continued by that much only."""
    data = ramp(["lag", "reference"], hold="first")
    data |= {"ripple": 4}
    data["units"]["reference"]["fine"] = True
    trace = run(write, data)
    r = trace["reference.r"]
    assert np.abs(np.diff(r[:21], 2)).max() < 1e-12  # a line
    # after two steps of the lag its input is the value at the end of its step
    y, keep = trace["lag.y"], np.exp(-H / TAU)
    got = (y[12::4] - keep * y[8:-4:4]) / (1 - keep)
    assert np.abs(got - r[12::4]).max() < 1e-12


def test_mixed_with_a_loop_and_several_rates(loop: Any, write: Any) -> None:
    loop["ripple"] = 4
    loop["units"]["plant"] |= {"fine": True, "substeps": 3}
    loop["units"]["pid"] |= {"hold": "first", "substeps": 2}
    loop["units"]["reference"]["fine"] = True
    assert np.ptp(run(write, loop)["plant.y"]) > 1


def test_what_cannot_be_is_refused(loop: Any, write: Any) -> None:
    data = ramp(["reference", "lag"], hold="first")
    data["units"]["reference"]["every"] = 2
    with pytest.raises(InputError, match=r"units\.lag\.hold: .* reference is slower"):
        ready(write(data))
    data = ramp(["reference", "lag"], substeps=2)
    with pytest.raises(InputError, match="ramp/nominal: lag must have no substeps"):
        to_graph(ready(write(data)))


def test_a_jump_between_two_steps_is_said(write: Any) -> None:
    data = ramp(["reference", "lag"])
    data["coupling"]["events"] = "grid"
    data["units"]["reference"] = {"block": "disturbance", "values": {"step": 1.0, "t_step": 0.0053, "amplitude": 0.0}}
    data["connections"]["lag.u"] = "reference.d"
    (result,) = hy.run([write(data)], engine="native")
    (note,) = result.notes
    assert note == (
        "ramp/nominal: reference.t_step: the discontinuity at 0.0053 s is between two steps of 0.001 s "
        "and takes effect at 0.006 s"
    )
    assert note in verdicts([result])
    trace = simulate(result.system, "native")
    assert np.flatnonzero(np.diff(trace["reference.d"])).tolist() == [5]  # 0 up to 5 ms, 1 from 6 ms on
    data["units"]["reference"]["values"]["t_step"] = 0.007
    assert hy.run([write(data)], engine="native")[0].notes == ()
    levels = {"shape": "steps", "levels": [0.0, 1.0, 1.0, 2.0], "T": 0.0025}
    data["units"]["reference"] = {"block": "reference", "dims": {"m": 4}, "values": levels}
    data["connections"]["lag.u"] = "reference.r"
    (result,) = hy.run([write(data)], engine="native")
    assert "reference.T: the discontinuity at 0.0025 s" in result.notes[0]
    data["units"]["reference"]["substeps"] = 2
    assert hy.run([write(data)], engine="native")[0].notes == ()


def test_delays_of_every_scheme(loop: Any, write: Any) -> None:
    """Jacobi: everything is read a step late; iterative: nothing."""

    def budget(scheme: str) -> dict[str, float]:
        system = build(Cases(write(loop), coupling=scheme).cases[0])  # type: ignore[arg-type]
        return {d.where: d.steps for d in delay_budget(system)}

    assert budget("gauss_seidel") == {"pid.u -> plant.u": 0.5}
    assert budget("jacobi") == {"pid.u -> plant.u": 0.5, "reference.r -> pid.y_d": 1.0, "plant.y -> pid.y": 1.0}
    assert budget("iterative") == {}
    loop["units"]["pid"]["hold"] = "first"
    assert budget("jacobi") == {"pid.u -> plant.u": 0.5, "reference.r -> pid.y_d": 0.0, "plant.y -> pid.y": 0.0}
