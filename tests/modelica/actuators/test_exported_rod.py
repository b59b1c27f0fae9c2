"""The current-driven actuator that `export_modelica` writes: as it comes, and against the model itself."""

import re
from dataclasses import replace
from pathlib import Path

import library
import numpy as np
import pytest
import simulate
import stacks

import hystfmu as hy

BOUND = 2e-3  # |actuator - model| / span, at 1 Hz: what eddy currents and rounded corners add to the model
QUICK = ("jiles_atherton, strain", "prandtl_ishlinskii")
KINDS = [pytest.param(k, marks=() if k in QUICK else pytest.mark.stress) for k in stacks.ROD_KINDS]


@pytest.mark.turn("exported actuators")
@pytest.mark.some(1)
@pytest.mark.parametrize("key", [k for k in KINDS if "g0_" not in str(k)])
def test_a_rod_follows_its_model(key: str, tmp_path: Path) -> None:
    """A free rod: the position against the output of the model for the current in the coil.

    Resistance and damping have no part in that: with the values of the form a coil of 100 A has a lag of 0.2 us and
    a rod without a mass one of 0.3 us.
    """
    model = stacks.rod(key)
    package = model.export_modelica(tmp_path / "Piezo")
    text = (package / "Actuator.mo").read_text()
    start, most, L, k = (float(re.search(rf"\n    {n} = ([-\d.e+]+)", text)[1]) for n in ("i_start", "i_max", "L", "k"))
    bench = f"""model Bench
  HystFMU.Sources.Sine command(amplitude = {0.45 * most!r}, offset = {start!r}, frequency = 1);
  HystFMU.Actuators.CurrentDrive drive(gain = 1, v_max = {1e3 * most!r}, K = {1e3 * L!r});
  HystFMU.Plants.Ground ground;
  HystFMU.Plants.Fixed wall;
  Piezo.Actuator actuator(resistance = {L!r}, c = {1e-5 * k!r});
equation
  connect(command.r, drive.u);
  connect(drive.pin_p, actuator.pin_p);
  connect(drive.pin_n, actuator.pin_n);
  connect(drive.pin_n, ground.pin);
  connect(wall.flange, actuator.flange_a);
end Bench;
"""
    v = simulate.solve_text(bench, 1.0, 1e-3, 1e-9, packages=(library.ROOT, package)).instants()
    t = np.arange(0, 1, model.step)
    y = model.predict(np.interp(t, v["time"], v["actuator.pin_p.i"]), model.step).reshape(-1) * 1e-6
    error = np.abs(np.interp(t, v["time"], v["actuator.flange_b.s"]) - y)[1:-2].max() / np.ptp(y)
    print(f"{key}: {error:.1e} of the span, {np.ptp(y):.2e} m")
    assert np.ptp(y) > 1e-5
    assert error <= BOUND


@pytest.mark.turn("exported actuators")
def test_a_data_sheet_gives_mass_coil_and_stiffness(tmp_path: Path) -> None:
    package = stacks.magnet().export_modelica(tmp_path / "Piezo", sheet={**stacks.ROD_SHEET, "inductance": 5e-3})
    text = (package / "Actuator.mo").read_text()
    values = {k: float(x) for k, x in re.findall(r"\n    (\w+) = ([-\d.e+]+)", text)}
    assert values["L"] == 5e-3
    assert values["resistance"] == 3.0
    slope = values["stroke"] / values["i_max"]
    d = slope / (values["share"] * values["L"])
    assert 1 / (1 / values["k"] + slope * d) == pytest.approx(1200.0 / 40e-6)
    v = stacks.as_it_comes(package)
    assert np.ptp(v["load.s"]) > 1e-5
    assert np.ptp(v["actuator.residual"]) <= 1e-5 * np.ptp(v["actuator.supplied"])


@pytest.mark.stress
def test_real_poles_are_the_lag_of_the_eddy_currents(tmp_path: Path) -> None:
    """G0 of time constants of 2 ms and 0.1 ms, known to 1 %."""
    slow, fast = 2e-3, 1e-4
    w = (slow * fast) ** -0.5
    zeta = (slow + fast) * w / 2
    graph = stacks.magnet().graph
    behind = {"b": [w * w], "a": [1.0, 2 * zeta * w, w * w]}
    g0 = hy.graph.Node("g0", "transfer_function", {"nb": 0, "na": 2}, behind)
    lagged = hy.graph.Graph(
        [*graph.nodes, g0],
        [*graph.wires, ("hysteresis.y", "g0.u")],
        graph.inputs,
        [replace(graph.outputs[0], source="g0.y")],
    )
    known = {"f_n": w / (2 * np.pi), "zeta": zeta, "f_n_se": 0.01 * w / (2 * np.pi), "zeta_se": 0.01 * zeta}
    model = replace(stacks.magnet(), graph=lagged, fit=known)
    text = (model.export_modelica(tmp_path / "Piezo") / "Actuator.mo").read_text()
    assert float(re.search(r"\n    tau = ([-\d.e+]+)", text)[1]) == pytest.approx(slow)
    assert "withMass = false" in text


FALLING = hy.Model(
    "plays",
    hy.Graph(
        [hy.Node("plays", "prandtl_ishlinskii"), hy.Node("readout", "scaling", {}, {"gain": -0.1})],
        [("plays.y", "readout.u")],
        [hy.Input("u", ("plays.u",), unit="V")],
        [hy.Output("y", "readout.y", unit="um")],
    ),
    1e-3,
    provenance={"span_u": [0.0, 100.0]},
)


@pytest.mark.parametrize(("model", "sheet", "says"), [
    (FALLING, {}, "must rise with the input over its range. Got a change of -"),
    (stacks.magnet(), {"capacitance": 1e-6}, "driven by A has no value 'capacitance'"),
    (stacks.knee(), {"inductance": 1e-3}, "driven by V has no value 'inductance'"),
    (stacks.magnet(strain=20.0), {}, "must rise with the input on every branch"),
    (stacks.magnet(weight=-25.0), {}, "must rise with the input on every branch"),
])  # fmt: skip
def test_what_is_no_rod_is_one_line(model: hy.Model, sheet: dict[str, float], says: str, tmp_path: Path) -> None:
    with pytest.raises(hy.InputError, match=says) as refused:
        model.export_modelica(tmp_path / "Piezo", sheet=sheet)
    assert "\n" not in str(refused.value)
