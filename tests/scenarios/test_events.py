"""Events between two steps are located: closed forms and loops in numpy, the same bits in every engine."""

import zipfile
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from engines import ready, same

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.fmu.write.export import export_fmu
from hystfmu.scenario import simulate
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.system import events as module
from hystfmu.scenario.system.events import cuts
from hystfmu.scenario.system.system import System

H, TAU = 1e-3, 5e-3
STEP = {"block": "disturbance", "values": {"step": 1.0, "t_step": 0.12345, "amplitude": 0.0}}


def behind(source: dict[str, Any], output: str, coupling: dict[str, Any], order: tuple[str, ...], hold: str) -> Any:
    """A lag y' = (u - y)/tau behind a source."""
    lag = {"b": [1.0], "a": [TAU, 1.0], "hold": hold}
    return {
        "name": "events",
        "step": H,
        "stop": 0.2,
        "coupling": coupling,
        "order": list(order),
        "units": {
            "source": source,
            "lag": {"block": "transfer_function", "dims": {"na": 1, "nb": 0}, "values": lag, "as": "fmu3"},
        },
        "connections": {"lag.u": f"source.{output}"},
        "metrics": {"peak": {"kind": "peak", "signal": "lag.y"}},
    }


def run(write: Any, data: dict[str, Any]) -> Trace:
    """Run by every engine; metrics see the even grid."""
    trace = same(ready(write(data)))
    assert np.allclose(trace.t, H * np.arange(len(trace.t)), rtol=1e-15)
    return trace


def answer(t: Any, at: float) -> Any:
    """Of the lag to a unit step."""
    return np.where(t < at, 0.0, 1 - np.exp(-(t - at) / TAU))


LATE = [("jacobi", ("source", "lag")), ("jacobi", ("lag", "source")), ("gauss_seidel", ("lag", "source"))]
EARLY = [("gauss_seidel", ("source", "lag")), ("iterative", ("source", "lag")), ("iterative", ("lag", "source"))]


@pytest.mark.some(5)
@pytest.mark.parametrize(
    ("scheme", "order", "hold"), [(*x, "zoh") for x in (*EARLY, *LATE)] + [(*x, "foh") for x in EARLY]
)
@pytest.mark.parametrize("unit", [{}, {"substeps": 3}])
def test_a_step_between_two_steps_is_hit(write: Any, scheme: str, order: Any, hold: str, unit: Any) -> None:
    """y = 1 - exp(-(t - 0.12345)/tau), whoever goes first; to 2e-9 of the time, which the core can tell apart."""
    data = behind(STEP, "d", {"scheme": scheme}, order, hold)
    data["units"]["lag"] |= unit
    trace = run(write, data)
    assert np.abs(trace["lag.y"] - answer(trace.t, 0.12345)).max() < (1e-13 if (scheme, order) in LATE else 1e-7)
    data["coupling"]["events"] = "grid"
    assert np.abs(run(write, data)["lag.y"] - answer(trace.t, 0.12345)).max() > 0.01


@pytest.mark.parametrize("order", [("source", "lag"), ("lag", "source")])
def test_straight_lines_begin_anew_at_a_jump(write: Any, order: Any) -> None:
    data = behind(STEP, "d", {"scheme": "gauss_seidel"}, order, "zoh")
    data["units"]["lag"] |= {"hold": "first", "substeps": 4}
    trace = run(write, data)
    assert np.abs(trace["lag.y"] - answer(trace.t, 0.12345)).max() < 1e-7


def test_kinks_of_a_ramp_are_hit(write: Any) -> None:
    """Behind a line of slope s the lag follows y = u - s tau + c exp(-t/tau), piece by piece."""
    f, phase = 7.3, 0.4
    source = {"block": "reference", "values": {"shape": "triangle", "frequency": f, "phase": phase}}
    data = behind(source, "r", {"scheme": "gauss_seidel"}, ("source", "lag"), "foh")
    trace = run(write, data)

    def u(t: float) -> float:
        return float(2 / np.pi * np.arcsin(np.sin(2 * np.pi * f * t + phase)))

    kinks = (np.arange(4) / 2 + 0.25 - phase / (2 * np.pi)) / f
    edges = np.sort(np.concatenate([kinks[kinks < 0.2], trace.t]))
    y, want = 0.0, [0.0]
    for a, b in pairwise(edges):
        slope = (u(b) - u(a)) / (b - a)
        y = u(b) - slope * TAU + (y - u(a) + slope * TAU) * np.exp(-(b - a) / TAU)
        if b in trace.t:
            want.append(y)
    assert np.abs(trace["lag.y"] - want).max() < 1e-12
    data["coupling"]["events"] = "grid"
    assert np.abs(run(write, data)["lag.y"] - want).max() > 1e-5


@pytest.mark.parametrize("shape", ["triangle", "random_reversals"])
def test_a_memory_takes_the_reversal_that_lies_between_two_steps(write: Any, shape: str) -> None:
    """A play of radius 0.05: z = max(u - r, min(u + r, z)) along the grid and the turning points of the input."""
    f = 11.7
    source = {"block": "reference", "values": {"shape": shape, "frequency": f, "amplitude": 1.0, "seed": 3}}
    data = behind(source, "r", {"scheme": "gauss_seidel"}, ("source", "play"), "zoh")
    play = {"block": "backlash_sum", "dims": {"n": 1}, "values": {"w0": 0.0, "r": [0.05], "w": [1.0]}}
    data["units"] = {"source": source, "play": play}
    data["connections"] = {"play.u": "source.r"}
    data["metrics"]["peak"]["signal"] = "play.y"
    trace = run(write, data)
    fine = ready(write(data | {"step": 1e-6, "coupling": {"events": "grid"}}))
    u = simulate(fine, "native")["source.r"]
    z, want = 0.0, np.empty(len(u))
    for k, v in enumerate(u.tolist()):
        z = want[k] = max(v - 0.05, min(v + 0.05, z))
    # the turning point of the input is flat to 1e-6 s (random) or a kink (triangle)
    assert np.abs(trace["play.y"] - want[::1000]).max() < 3e-5
    data["coupling"]["events"] = "grid"
    assert np.abs(run(write, data)["play.y"] - want[::1000]).max() > 1e-4


def test_who_counts_samples_takes_no_sample_more(loop: Any, write: Any) -> None:
    """A sampled PI around a lag, disturbed between samples, against a loop in numpy that knows when."""
    kp, ki, at = 0.8, 40.0, 0.01037
    data = behind(STEP, "d", {}, ("plant", "noise", "delay", "pid", "source"), "zoh")
    plant = {
        "blocks": [
            {"name": "sum", "type": "sum"},
            {"name": "lag", "type": "transfer_function", "dims": {"na": 1, "nb": 0}, "values": {"b": [1.0]}},
        ],
        "wires": [["sum.y", "lag.u"]],
        "inputs": [{"name": "u", "to": ["sum.u[1]"]}, {"name": "d", "to": ["sum.u[2]"]}],
        "outputs": [{"name": "y", "source": "lag.y"}],
    }
    plant["blocks"][1]["values"]["a"] = [TAU, 1.0]  # type: ignore[index]
    data["units"] = {
        "plant": {"graph": plant, "fine": True},
        "source": {"block": "disturbance", "values": {"step": 1.0, "t_step": at, "amplitude": 0.0}, "fine": True},
        "pid": {"block": "pid", "values": {"Kp": kp, "Ki": ki, "Kd": 0.0}, "inputs": {"u_ff": 0.0}},
        "noise": {"block": "noise", "values": {"sigma": 1.0}},
        "delay": {"block": "delay", "dims": {"n": 3}},
    }
    data["connections"] = {
        "plant.u": "pid.u", "plant.d": "source.d", "pid.y": "plant.y", "pid.y_d": "noise.w", "delay.u": "noise.w"
    }  # fmt: skip
    data |= {"ripple": 4, "step": 4 * H, "stop": 0.04}
    data["metrics"]["peak"]["signal"] = "plant.y"
    trace = run(write, data)
    w = trace["noise.w"]
    assert len(np.unique(w)) == 11
    assert np.array_equal(trace["delay.y"][12:], w[:-12])
    y, u, integral, want = 0.0, trace["pid.u"][0], 0.0, [0.0]
    for n in range(1, 41):
        for a, b in pairwise(np.clip([(n - 1) * H, at, n * H], (n - 1) * H, n * H)):
            v = u + (1.0 if a >= at else 0.0)
            y = v + (y - v) * np.exp(-(b - a) / TAU)
        want.append(y)
        if n % 4 == 0:
            e = w[n] - y
            integral += e * 4 * H
            u = kp * e + ki * integral
    assert np.abs(trace["plant.y"] - want).max() < 1e-7


@pytest.mark.parametrize("ripple", [1, 5])
def test_events_on_the_grid_change_no_bit(write: Any, ripple: int) -> None:
    for source, output in (
        ({"block": "disturbance", "values": {"step": 1.0, "t_step": 0.123}}, "d"),
        ({"block": "reference", "dims": {"m": 3}, "values": {"shape": "steps", "levels": [0, 1, 3], "T": 0.007}}, "r"),
        ({"block": "reference", "values": {"shape": "random_reversals", "frequency": 10.0}}, "r"),
        ({"block": "reference", "values": {"shape": "triangle", "frequency": 12.5, "lead": 0.004}}, "dr_lead"),
    ):
        data = behind(source, output, {}, ("lag", "source"), "zoh") | {"ripple": ripple}
        source["fine"] = True
        located = simulate(ready(write(data)), "native").values.tobytes()
        data["coupling"]["events"] = "grid"
        assert simulate(ready(write(data)), "native").values.tobytes() == located


@pytest.mark.some(6)
@pytest.mark.parametrize(
    "at", [0.05, 0.05 * (1 + 1e-14), 0.05 + 1e-10, 0.05 + 1e-8, 0.05 - 1e-10, 0.05 - 1e-8, 0.1999999999999, 1e-9]
)
@pytest.mark.parametrize("order", [("source", "lag"), ("lag", "source")])
def test_near_a_grid_point(write: Any, at: float, order: Any) -> None:
    """On the grid a discontinuity cuts no step; right beside it, it is located."""
    source = {"block": "disturbance", "values": {"step": 1.0, "t_step": at, "amplitude": 0.0}}
    trace = run(write, behind(source, "d", {}, order, "zoh"))
    on = abs(at / H - round(at / H)) < 1e-6 * H
    at -= H if on and order[0] == "source" else 0.0  # the value of the end acts over the step
    assert np.abs(trace["lag.y"] - answer(trace.t, at)).max() < 1e-6


def test_several_events_in_a_step_and_several_sources(write: Any) -> None:
    """Levels that change every 0.3 ms, and a disturbance with a discontinuity at the time of one of them."""
    T = 3.1e-4
    levels = {"shape": "steps", "levels": [0.0, 1.0, -2.0, -2.0, 3.0, 0.5], "T": T}
    data = behind({"block": "reference", "dims": {"m": 6}, "values": levels}, "r", {}, ("lag", "source", "d"), "zoh")
    data["units"] |= {"d": {"block": "disturbance", "values": {"step": 1.0, "t_step": 2 * T, "amplitude": 0.0}}}
    data["units"]["lag"] |= {"inputs": {}}
    data["units"]["sum"] = {"block": "sum"}
    for order in (["lag", "source", "d", "sum"], ["source", "d", "sum", "lag"]):
        data["order"] = order
        data["connections"] = {"sum.u_1": "source.r", "sum.u_2": "d.d", "lag.u": "sum.y"}
        trace = run(write, data)
        want = sum(j * answer(trace.t, k * T) for k, j in ((1, 1.0), (2, -3.0), (2, 1.0), (4, 5.0), (5, -2.5)))
        assert np.abs(trace["lag.y"] - want).max() < 1e-7


def test_the_preview_has_events_of_its_own(write: Any) -> None:
    steps = {"shape": "steps", "levels": [0.0, 1.0], "T": 0.02, "lead": 0.00037}
    data = behind({"block": "reference", "dims": {"m": 2}, "values": steps}, "r_lead", {}, ("source", "lag"), "zoh")
    trace = run(write, data)
    assert np.abs(trace["lag.y"] - answer(trace.t, 0.02 - 0.00037)).max() < 1e-7
    data["connections"]["lag.u"] = "source.r"  # nothing reads the preview
    assert len(cuts(ready(write(data)))[0]) == 0


@pytest.mark.parametrize("shape", ["triangle", "random_reversals"])
def test_too_many_reversals_are_refused(write: Any, shape: str) -> None:
    def source(f: float) -> dict[str, Any]:
        return {"block": "reference", "dims": {"m": 4}, "values": {"shape": shape, "frequency": f}}

    # 0.2 s with two reversals a period: the limit of 2e7 is met at 5e7 Hz
    with pytest.raises(InputError, match=r"source\.frequency: more than 20000000 reversals; got 5\.1e\+07 Hz"):
        cuts(ready(write(behind(source(5.1e7), "r", {}, ("source", "lag"), "zoh"))))
    cuts(ready(write(behind(source(0.0), "r", {}, ("source", "lag"), "zoh"))))


def test_other_values_have_other_events(write: Any) -> None:
    """A study changes parameters of a case that is ready to run."""
    data = behind(STEP, "d", {}, ("lag", "source"), "zoh")
    data["units"]["pid"] = {"block": "pid", "inputs": {"u_ff": 0.0, "y_d": 1.0}}
    data |= {"order": ["lag", "pid", "source"], "connections": data["connections"] | {"pid.y": "lag.y"}}
    native = Native(ready(write(data)))
    for at in (0.05, 0.0123, 0.12345, 0.0777):
        native.set({"source.t_step": at})
        data["units"]["source"] = {**STEP, "set": {"t_step": at}}
        assert native.run().values.tobytes() == run(write, data).values.tobytes()


def test_a_source_that_is_slow_by_its_own_choice_says_so(write: Any) -> None:
    data = behind({**STEP, "every": 2}, "d", {}, ("source", "lag"), "zoh")
    (result,) = hy.run([write(data)], engine="native")
    assert result.notes == (
        "events/nominal: source.t_step: the discontinuity at 0.12345 s is between two steps of 0.002 s "
        "and takes effect at 0.124 s",
    )
    data["units"]["source"] = STEP
    assert hy.run([write(data)], engine="native")[0].notes == ()


@pytest.mark.turn("foreign units")
@pytest.mark.some(1)
@pytest.mark.parametrize("any_step", [False, True])
@pytest.mark.parametrize("fmi", [2, 3])
def test_an_fmu_of_others_is_cut_if_it_says_that_it_can(write: Any, tmp_path: Path, fmi: Any, any_step: bool) -> None:
    data = behind(STEP, "d", {}, ("lag", "source"), "zoh")
    system = ready(write(data))
    own = tmp_path / "scenarios" / "own.fmu"
    export_fmu(system.parts[0].own, own, fmi=fmi)
    with zipfile.ZipFile(own) as old, zipfile.ZipFile(own.with_name("lag.fmu"), "w") as new:
        for name in old.namelist():
            text = old.read(name)
            if name == "modelDescription.xml" and not any_step:
                text = text.replace(b'StepSize="true"', b'StepSize="false"')
            new.writestr(name, text)
    data["units"]["lag"] = {"fmu": "../lag.fmu"}
    foreign = ready(write(data))
    traces = [simulate(foreign, e) for e in ("fmpy", "native")]
    assert traces[0].values.tobytes() == traces[1].values.tobytes()
    want = simulate(system, "native")["lag.y"]
    assert np.array_equal(traces[0]["lag.y"], want) == any_step
    held = np.abs(traces[0]["lag.y"] - answer(want, 0.0))[:124]
    assert any_step or held.max() == 0  # its input is that of the last grid point


def test_a_turn_around_may_begin_before_the_run(write: Any) -> None:
    """Its extremum is 0.01 periods before t = 0, its end 0.1 - 0.01 periods after it."""
    values = {"shape": "triangle", "frequency": 10.1, "turn": 0.4, "phase": -0.48 * np.pi}
    system = ready(write(behind({"block": "reference", "values": values}, "r", {}, ("source", "lag"), "zoh")))
    joints = np.ravel(np.add.outer((np.arange(-2, 9) / 2 - 0.01) / 10.1, [-0.1 / 10.1, 0.1 / 10.1]))
    assert cuts(system)[1] == pytest.approx(joints[(joints > 0) & (joints < 0.2)], rel=1e-12)


# ---- most reversals --------------------------------------------------------------------------------------------------


def test_as_many_reversals_as_steps_may_be(write: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def triangle(most: int, f: float) -> System:
        monkeypatch.setattr(module, "MOST_STEPS", most)
        source = {"block": "reference", "values": {"shape": "triangle", "frequency": f, "phase": 0.3}}
        return ready(write(behind(source, "r", {}, ("source", "lag"), "zoh") | {"step": 2.0**-6, "stop": 1.0}))

    assert len(cuts(triangle(80, 8.0))[1]) == 16  # 64 fine steps and 16 cuts
    for most, f, said in (
        (80, 8.5, "more than 80 "),
        (32, 8.0, "case nominal: more than 32 fine steps and events$"),
        (31, 16.0, r"source\.frequency: more than 31 reversals; got 16 Hz$"),
    ):
        with pytest.raises(InputError, match=said):
            cuts(triangle(most, f))
