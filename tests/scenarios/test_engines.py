"""Every engine and one graph give the same bits; a closed loop and couplings against numpy."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.signal
from engines import ENGINES, ready, same
from fmu_slave import Slave

import hystfmu as hy
from hystfmu.fmu.write.export import export_fmu
from hystfmu.scenario import simulate, to_graph
from hystfmu.scenario.outcome.metrics import label, unit_of, unit_of_metric
from hystfmu.scenario.outcome.trace import Stopped

KINDS = ("fmu2", "fmu3")


def multirate(loop: dict[str, Any]) -> dict[str, Any]:
    """The loop with a fine plant, sensor noise, and a slow outer unit."""
    loop["ripple"] = 5
    loop["order"] = ["plant", "reference", "noise", "sensor", "slow", "pid"]
    loop["units"]["plant"]["fine"] = True
    loop["units"]["reference"]["fine"] = True
    loop["units"]["noise"] = {"block": "noise", "values": {"sigma": 1e-3}}
    loop["units"]["sensor"] = {"block": "sum"}
    loop["units"]["slow"] = {"block": "sum", "dims": {"n": 1}, "values": {"k": [0.1]}, "every": 3}
    loop["units"]["pid"]["inputs"] = {}
    loop["connections"] |= {
        "sensor.u_1": "plant.y", "sensor.u_2": "noise.w", "pid.y": "sensor.y", "slow.u": "reference.r",
        "pid.u_ff": "slow.y",
    }  # fmt: skip
    return loop


@pytest.mark.parametrize("kinds", [KINDS[:1], KINDS[1:], KINDS])
def test_every_kind_of_unit_gives_the_bits_of_the_fused_core(loop: Any, write: Any, kinds: tuple[str, ...]) -> None:
    data = multirate(loop)
    for k, unit in enumerate(data["units"].values()):
        unit["as"] = kinds[k % len(kinds)]
    system = ready(write(data))
    by_units, native = simulate(system), simulate(system, "native")
    assert by_units.values.tobytes() == native.values.tobytes()
    assert np.ptp(native["plant.y"]) > 1  # something happened


def test_the_loop_as_one_graph_and_one_fmu_gives_the_same_bits(loop: Any, write: Any, tmp_path: Path) -> None:
    system = ready(write(loop))
    trace = simulate(system, "native")
    graph = to_graph(system)
    n = system.n_steps + 1
    assert graph.run(np.full((n, 1), 0.125), system.h).tobytes() == trace.values.tobytes()

    fmu = Slave(export_fmu(graph, tmp_path / "loop.fmu", fmi=2), tmp_path / "unpacked")
    rows = [fmu.start()]  # the constant input is the start value: nothing to set
    rows += [fmu.step(k * system.h, system.h) for k in range(system.n_steps)]
    fmu.free()
    assert np.array(rows).tobytes() == trace.values.tobytes()


def test_units_of_different_rates_do_not_fit_into_one_graph(loop: Any, write: Any) -> None:
    system = ready(write(multirate(loop)))
    with pytest.raises(ValueError, match="the same rate"):
        to_graph(system)


def test_the_slow_unit_changes_every_third_step_only(loop: Any, write: Any) -> None:
    trace = simulate(ready(write(multirate(loop))), "native")
    changed = np.flatnonzero(np.diff(trace["slow.y"])) + 1
    assert set(changed % (5 * 3)) == {0}
    assert np.array_equal(trace["slow.y"][15::15], 0.1 * trace["reference.r"][15::15])
    held = np.flatnonzero(np.diff(trace["pid.u"])) + 1
    assert set(held % 5) == {0}


def test_the_plant_between_samples_is_the_plant_at_the_fine_step(loop: Any, write: Any) -> None:
    """The exact discretisation of G0: the same samples whether it runs once or ten times between them."""
    coarse = simulate(ready(write(loop)), "native")
    loop["ripple"] = 10
    loop["units"]["plant"]["fine"] = True
    fine = simulate(ready(write(loop)), "native")
    assert len(fine.t) == 10 * (len(coarse.t) - 1) + 1
    assert np.abs(fine["plant.y"][::10] - coarse["plant.y"]).max() < 1e-12


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr(tempfile, "tempdir", None)
    return folder


def test_nothing_is_left_in_the_temporary_folder(loop: Any, write: Any, temporary: Path) -> None:
    hy.run([write(loop)])
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize("kind", ["fmu2", "fmu3"])
def test_a_run_that_overflows_is_a_failure_and_not_bad_input(
    loop: Any, write: Any, temporary: Path, kind: str, capfd: pytest.CaptureFixture[str]
) -> None:
    loop["units"]["large"] = {"block": "sum", "dims": {"n": 1}, "values": {"k": [1e308]}}
    loop["units"]["reference"]["values"]["amplitude"] = 1e6
    loop["units"]["pid"] |= {"inputs": {}, "as": kind}
    loop["order"] = ["plant", "reference", "large", "pid"]
    loop["connections"] |= {"large.u": "reference.r", "pid.u_ff": "large.y"}
    system = ready(write(loop))
    for engine in ("fmpy", "native"):
        with pytest.raises(Stopped, match=r"refuses|not finite"):
            simulate(system, engine)  # type: ignore[arg-type]
    (result,) = hy.run([write(loop)])
    assert not result.passed
    (line,) = result.failures()
    assert line.startswith(
        "loop/nominal: stopped: large refuses the step from t = 0 s: 'y' is infinite at t = 0.0001 s"
    )
    assert capfd.readouterr() == ("", "")
    assert list(temporary.iterdir()) == []


# ---- in numpy --------------------------------------------------------------------------------------------------------
def test_plays_g0_and_pid_in_numpy(loop: Any, write: Any) -> None:
    trace = simulate(ready(write(loop)))
    h, n = 1e-4, 300
    omega = 2 * np.pi * 500
    A, B, C, D = scipy.signal.tf2ss([omega**2], [1, 1.4 * omega, omega**2])
    Ad, Bd, *_ = scipy.signal.cont2discrete((A, B, C, D), h, "zoh")
    r, w = np.array([0.1, 0.2, 0.3]), np.array([0.3, 0.2, 0.1])
    z, x, integral, u = np.zeros(3), np.zeros(2), 0.0, 0.0
    e_last, expected = 0.0, [0.0]
    u = 0.125  # at the start: no error, no derivative
    for k in range(1, n + 1):
        # the plant moves on under the command of the last sample, then the controller sees its new output
        z = np.clip(z, u - r, u + r)
        x = Ad @ x + Bd[:, 0] * (0.3 * u + w @ z)
        y = (C @ x)[0]
        e = np.sin(2 * np.pi * 50 * k * h) - y
        integral += e * h
        u = 0.125 + 1.0 * e + 2000.0 * integral + 2e-4 * (e - e_last) / h
        e_last = e
        expected.append(y)
    gap = np.abs(trace["plant.y"] - np.array(expected)).max()
    assert gap < 1e-12, gap
    assert np.ptp(expected) > 1


# ---- couplings -------------------------------------------------------------------------------------------------------
def gains(k1: float, k2: float, coupling: dict[str, Any]) -> dict[str, Any]:
    """A loop of two static gains around a reference: x = r + k2 z, z = k1 x, whose solution is x = r / (1 - k1 k2)."""
    return {
        "name": "gains",
        "step": 1e-3,
        "stop": 0.02,
        "coupling": coupling,
        "order": ["reference", "x", "z"],
        "units": {
            "reference": {"block": "reference", "values": {"shape": "sine", "amplitude": 1.0, "frequency": 50.0}},
            "x": {"block": "sum", "values": {"k": [1.0, k2]}},
            "z": {"block": "sum", "dims": {"n": 1}, "values": {"k": [k1]}, "as": "fmu3"},
        },
        "connections": {"x.u_1": "reference.r", "x.u_2": "z.y", "z.u": "x.y"},
        "metrics": {"peak": {"kind": "peak", "signal": "x.y"}},
    }


def test_gauss_seidel_is_one_step_late_and_jacobi_two(write: Any) -> None:
    """z is read before it is made: x_n = r_n + k2 k1 x_{n-1}; with Jacobi x_n = r_{n-1} + k2 k1 x_{n-2}."""
    late = same(ready(write(gains(0.5, 0.5, {"scheme": "gauss_seidel"}))))
    r, x = late["reference.r"], late["x.y"]
    assert np.array_equal(x[1:], r[1:] + 0.5 * (0.5 * x[:-1]))
    later = same(ready(write(gains(0.5, 0.5, {"scheme": "jacobi"}))))
    r, x, z = later["reference.r"], later["x.y"], later["z.y"]
    assert np.array_equal(x[1:], r[:-1] + 0.5 * z[:-1])
    assert np.array_equal(z[1:], 0.5 * x[:-1])


def test_sweeps_that_do_not_agree_are_a_failure_that_says_so(write: Any) -> None:
    """Two sweeps are not enough without derivatives: the second one sees the first residual."""
    data = gains(0.5, 0.5, {"scheme": "iterative", "max_sweeps": 2})
    data["units"]["z"] = {
        "block": "pid",
        "values": {"Kp": 0.5, "Ki": 0.0, "Kd": 0.0},
        "inputs": {"y": 0.0, "u_ff": 0.0},
    }
    data["connections"] = {"x.u_1": "reference.r", "x.u_2": "z.u", "z.y_d": "x.y"}
    system = ready(write(data))
    for engine in ENGINES:
        with pytest.raises(Stopped, match=r"^2 sweeps at t = 0\.001 s do not converge"):
            simulate(system, engine)


def test_the_command_line_chooses_the_coupling(loop: Any, write: Any) -> None:
    """Results per scheme: one step of delay more costs accuracy."""
    folder = write(loop)
    rms = {}
    for scheme in ("gauss_seidel", "jacobi", "iterative"):
        (result,) = hy.run([folder], engine="native", coupling=scheme)
        (verdict,) = result.verdicts
        rms[scheme] = verdict.value
    assert rms["iterative"] <= rms["gauss_seidel"] < rms["jacobi"]


def test_iterative_through_hysteresis_and_dynamics(loop: Any, write: Any) -> None:
    """The order of the units no longer matters, and memories are those of the last sweep alone."""
    loop["coupling"] = {"scheme": "iterative", "tolerance": 1e-13}
    loop["units"]["plant"]["as"] = "fmu3"
    first = same(ready(write(loop)))
    loop["order"] = loop["order"][::-1]
    second = same(ready(write(loop)))
    assert np.ptp(first["plant.y"]) > 1
    assert np.abs(first["plant.y"] - second["plant.y"])[1:].max() < 1e-10


@pytest.mark.parametrize("scheme", ["jacobi", "iterative"])
def test_units_of_several_rates(loop: Any, write: Any, scheme: str) -> None:
    loop["ripple"] = 4
    loop["units"]["plant"]["fine"] = True
    loop["units"]["reference"]["fine"] = True
    loop["coupling"] = {"scheme": scheme}
    trace = same(ready(write(loop)))
    held = np.flatnonzero(np.diff(trace["pid.u"])) + 1
    assert set(held % 4) == {0}


# ---- one graph -----------------------------------------------------------------------------------------------------


def test_units_of_measure_follow_connections_metrics_and_blocks_that_do_not_scale(loop: Any, write: Any) -> None:
    plant = loop["units"]["plant"]["graph"]
    plant["outputs"][0]["unit"], plant["inputs"][0]["unit"] = "um", "V"
    loop["units"] |= {
        "late": {"block": "delay", "dims": {"n": 2}},
        "error": {"block": "sum", "values": {"k": [1.0, -1.0]}},
        "half": {"block": "sum", "values": {"k": [0.5, 0.0]}},
    }
    loop["order"] += ["late", "error", "half"]
    loop["connections"] |= {"late.u": "plant.y", "error.u_1": "late.y", "error.u_2": "plant.y"}
    loop["connections"] |= {"half.u_1": "late.y", "half.u_2": "late.y"}
    s = ready(write(loop))
    ends = ("plant.y", "reference.r", "pid.y", "late.y", "error.y", "half.u_1", "half.y", "pid.u", "plant.u")
    assert [unit_of(s, e) for e in ends] == ["um", "um", "um", "um", "um", "um", "", "V", "V"]
    peak, rms = (s.case.metrics["tracking"].model_copy(update={"kind": k}) for k in ("peak", "rms"))
    assert [unit_of_metric(s, m) for m in (peak, rms, s.case.metrics["tracking"])] == ["um", "um", "%"]
    assert [label("a", "um"), label("a", "")] == ["a in um", "a"]
    loop["metrics"]["tracking"]["kind"] = "final"
    del loop["metrics"]["tracking"]["stroke"]
    assert unit_of(ready(write(loop)), "reference.r") == "um"
    plant["inputs"][0]["unit"] = "um"
    plant["outputs"][0]["unit"] = "V"
    loop["connections"]["late.u"] = "pid.u"  # a sum of V and um
    s = ready(write(loop))
    assert [unit_of(s, e) for e in ("plant.u", "plant.y", "late.y", "error.y", "reference.r")] == [
        "um", "V", "", "", "",
    ]  # fmt: skip
