"""A loop around an actuator between pins and flanges: controllers of the library and of the standard library."""

import html
import re
import tomllib
from pathlib import Path

import bench
import library
import numpy as np
import pytest
import simulate

import hystfmu as hy
from hystfmu.graph import Graph, Input, Node, Output

SCENARIO = library.ROOT.parents[1] / "scenarios" / "pid"
SETTLED = 0.1  # s


def tracking(found: dict[str, np.ndarray]) -> float:
    """Root mean square of the error in percent of the stroke, over the last period."""
    late = found["time"] >= SETTLED
    return float(50 * np.sqrt(np.mean((found["reading.y"] - found["reference.r"])[late] ** 2)))


def simulated(text: str, packages: tuple[Path, ...]) -> dict[str, np.ndarray]:
    return simulate.solve_text(text, 0.2, 1e-4, 1e-9, packages=packages).values


@pytest.mark.stress
def test_a_controller_of_the_library_holds_a_stack_on_its_reference() -> None:
    """A spring beside the load takes a twentieth of the stroke, which the integral part gives back."""
    with_it = simulate.run("HystFMU.Examples.StackInLoop").instants()
    without = simulated(
        "model Open extends HystFMU.Examples.StackInLoop(controller(Kp = 0, Ki = 0)); end Open;", (library.ROOT,)
    )
    assert tracking(with_it) < 0.2
    assert tracking(without) > 1.5


@pytest.mark.stress
@bench.needs_standard
def test_a_controller_of_the_standard_library_does() -> None:
    """The loop that the guide shows."""
    page = library.text(library.ROOT / "UsersGuide" / "TutorialActuator.mo")
    code = re.search(r"<pre>\n(.*?)</pre>", page, re.DOTALL)
    assert code is not None
    text = html.unescape(code[1]).replace('\\"', '"')
    assert tracking(simulated(text, bench.roots())) < 2


F_N, ZETA = 500.0, 0.7  # Hz, of the plant of the scenario
VOLTS, STROKE = 100.0, 20e-6  # V and m of an input and an output of 1
# amplifier, actuator and sensor in the place of the plant
PLANT = """block Plant
  extends HystFMU.Interfaces.Plant;
  parameter HystFMU.Types.Time Ts = 1e-4;
  HystFMU.Actuators.VoltageDrive drive(gain = {volts}, T_v = 2e-6, T_i = 1e-6, v_min = -{most}, v_max = {most});
  HystFMU.Plants.Ground ground;
  HystFMU.Plants.Fixed wall;
  Piezo.Actuator actuator;
  HystFMU.Plants.PositionSensor sensor;
  HystFMU.Loops.Affine reading(gain = {per_metre});
equation
  connect(u, drive.u);
  connect(drive.pin_p, actuator.pin_p);
  connect(drive.pin_n, actuator.pin_n);
  connect(drive.pin_n, ground.pin);
  connect(wall.flange, actuator.flange_a);
  connect(actuator.flange_b, sensor.flange);
  connect(sensor.s, reading.u);
  connect(reading.y, y);
end Plant;
model Loop
  extends HystFMU.Loops.Tracking(
    redeclare HystFMU.Control.Pid controller({law}, Ts = Ts),
    redeclare Plant plant(Ts = Ts));
end Loop;
"""


def plant() -> hy.Model:
    """The plant of the scenario in volts and micrometres, its mode known to 1 %."""
    behind = {"b": [1.0], "a": [1 / (OMEGA_N := 2 * np.pi * F_N) ** 2, 2 * ZETA / OMEGA_N, 1.0]}
    nodes = [
        Node("input", "scaling", {"n": 1}, {"gain": 1 / VOLTS}),
        Node("hysteresis", "prandtl_ishlinskii", {"n": 10}, {"w0": 0.3, "r": np.linspace(0.05, 0.5, 10), "w": 0.1}),
        Node("g0", "transfer_function", {"nb": 0, "na": 2}, behind),
        Node("readout", "scaling", {"n": 1}, {"gain": 1e6 * STROKE}),
    ]
    wires = [("input.y", "hysteresis.u"), ("hysteresis.y", "g0.u"), ("g0.y", "readout.u")]
    ports = [Input("u", ("input.u",), unit="V")], [Output("y", "readout.y", unit="um")]
    known = {"f_n": F_N, "zeta": ZETA, "f_n_se": 0.01 * F_N, "zeta_se": 0.01 * ZETA}
    return hy.Model(
        "g0_prandtl_ishlinskii", Graph(nodes, wires, *ports), 1e-4, fit=known, provenance={"span_u": [-VOLTS, VOLTS]}
    )


@pytest.mark.stress
def test_a_loop_around_an_exported_actuator_gives_the_figures_of_the_scenario(tmp_path: Path) -> None:
    """To a tenth: a fast amplifier and the leads add a lag to the plant of the scenario."""
    package = plant().export_modelica(tmp_path / "Piezo")
    units = tomllib.loads((SCENARIO / "scenario.toml").read_text())["units"]
    law = ", ".join(f"{k} = {v!r}" for k, v in units["pid"]["values"].items())
    text = PLANT.format(volts=VOLTS, most=2 * VOLTS, per_metre=1 / STROKE, law=law)
    v = simulated(text, (library.ROOT, package))
    late = v["time"] >= SETTLED
    found = float(50 * np.sqrt(np.mean((v["plant.y"] - v["reference.r"])[late] ** 2)))
    figures = tomllib.loads((SCENARIO / "baseline.toml").read_text())["case"]["sine_10"]["metrics"]
    print(f"tracking error {found:.4f} % of the stroke for {figures['tracking']:.4f} %")
    assert found == pytest.approx(figures["tracking"], rel=0.1)
