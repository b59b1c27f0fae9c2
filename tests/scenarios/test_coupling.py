"""Couplings: Gauss-Seidel, Jacobi and iterative, against closed forms, the same bits in every engine."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from engines import ENGINES, ready, same

import hystfmu as hy
from hystfmu.scenario import simulate
from hystfmu.scenario.outcome.trace import Stopped


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


@pytest.mark.parametrize(("k1", "k2"), [(0.5, 0.5), (-0.9, 0.9), (-3.0, 2.0), (4.0, 1.0)])
def test_iterative_solves_the_algebraic_loop(write: Any, k1: float, k2: float) -> None:
    trace = same(ready(write(gains(k1, k2, {"scheme": "iterative", "tolerance": 1e-12}))))
    assert np.abs(trace["x.y"][1:] - trace["reference.r"][1:] / (1 - k1 * k2)).max() < 1e-11 * abs(1 / (1 - k1 * k2))


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
        with pytest.raises(Stopped, match=r"^2 sweeps at t = 0\.001 s do not agree"):
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
