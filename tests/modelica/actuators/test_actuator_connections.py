"""Ways to connect an actuator that other libraries make a trap: sources, grounds, flanges, stacks, initial states."""

from __future__ import annotations

from pathlib import Path

import bench
import numpy as np
import pytest

pytestmark = bench.needs_standard

SOURCE = "  Modelica.Electrical.Analog.Sources.SineVoltage source(V = 40, f = 50, offset = 50);\n"
FED = "  connect(source.n, ground.p);\n  connect(source.p, line.p);\n"
LOAD = """
  Modelica.Mechanics.Translational.Components.Mass mass(m = 0.5, s(fixed = true), v(fixed = true));
  Modelica.Mechanics.Translational.Components.SpringDamper spring(c = 2e6, d = 800);
  Modelica.Mechanics.Translational.Components.Fixed other;
"""
LOADED = """
  connect(stack.flange_b, mass.flange_a);
  connect(mass.flange_b, spring.flange_a);
  connect(spring.flange_b, other.flange);
"""
STACK = "  HystFMU.Actuators.Stack stack;\n"
BARE = "  HystFMU.Actuators.Stack stack(withMass = false);\n"


def run(tmp_path: Path, declared: str, joined: str = "") -> dict[str, np.ndarray]:
    parts = bench.ELECTRICAL + SOURCE + bench.WALL + declared
    v = bench.run(tmp_path, parts, bench.WIRED + FED + bench.HELD + joined)
    assert np.ptp(v["stack.residual"]) <= 1e-9 * np.abs(v["stack.supplied"]).max()
    return v


def test_a_source_with_offset_needs_no_start_value(tmp_path: Path) -> None:
    """The stack begins at 0 V: the leads limit the current."""
    v = run(tmp_path, BARE + LOAD, LOADED)
    assert v["stack.pin_p.i"][0] == pytest.approx(50 / 21, rel=1e-9)
    assert np.ptp(v["mass.s"]) > 1e-6


def test_a_start_at_the_offset_does_not_jump(tmp_path: Path) -> None:
    v = run(tmp_path, "  HystFMU.Actuators.Stack stack(v_start = 50);\n")
    assert abs(v["stack.pin_p.i"][0]) < 1e-9
    assert v["stack.flange_b.s"][0] == pytest.approx(26e-6 / 1.025 * (0.3 + 10 * 0.1) * 0.5, rel=1e-9)
    assert abs(np.diff(v["stack.flange_b.s"])[:5]).max() < 1e-8  # a jump would be of 1e-5


def test_a_steady_start_is_in_equilibrium_with_the_load(tmp_path: Path) -> None:
    """A spring is compressed from the first instant, under the voltage that the source has then."""
    source = SOURCE.replace("f = 50", "f = 50, startTime = 0.01")
    declared = "  HystFMU.Actuators.Stack stack(start = HystFMU.Types.Start.steady);\n" + LOAD.split("\n", 2)[2]
    joined = "  connect(stack.flange_b, spring.flange_a);\n  connect(spring.flange_b, other.flange);\n"
    parts = bench.ELECTRICAL + source + bench.WALL + declared
    v = bench.run(tmp_path, parts, bench.WIRED + FED + bench.HELD + joined)
    still = v["time"] < 0.0099
    s = v["stack.flange_b.s"]
    assert s[0] > 5e-6
    assert np.ptp(s[still]) < 1e-6 * s[0]
    assert np.abs(v["stack.pin_p.i"][still]).max() < 1e-7
    # tension of the stack balances the spring: k (s - y) = -c s
    assert 4e7 * (s[0] - v["stack.hysteresis.y"][0]) == pytest.approx(-2e6 * s[0], rel=1e-6)


def test_a_second_ground_changes_nothing(tmp_path: Path) -> None:
    """Behind a resistor, because two ideal grounds at one node leave their currents open in any library."""
    v = run(tmp_path, STACK)
    more = "  HystFMU.Plants.Ground second;\n  Modelica.Electrical.Analog.Basic.Resistor between(R = 1e-3);\n"
    w = run(tmp_path, STACK + more, "  connect(between.p, stack.pin_n);\n  connect(second.pin, between.n);\n")
    assert np.abs(v["stack.flange_b.s"] - w["stack.flange_b.s"]).max() < 1e-12


def test_a_floating_stack_has_no_hidden_ground(tmp_path: Path) -> None:
    """Ground at the positive pin: the voltage across the stack is the same, its potentials are not."""
    v = run(tmp_path, STACK)
    joined = """
  connect(source.p, line.p);
  connect(line.n, stack.pin_p);
  connect(stack.pin_n, source.n);
  connect(stack.pin_p, ground.p);
"""
    w = bench.run(tmp_path, bench.ELECTRICAL + SOURCE + bench.WALL + STACK, joined + bench.HELD)
    assert np.abs(w["stack.pin_p.v"]).max() < 1e-9
    assert np.abs(v["stack.v"] - w["stack.v"]).max() < 1e-6


def test_without_a_wall_the_momentum_stays(tmp_path: Path) -> None:
    """Two masses at the ends, one with a velocity: no mechanical ground, no hidden one either."""
    declared = """
  Modelica.Mechanics.Translational.Components.Mass one(m = 0.3, s(fixed = true), v(start = 0.02, fixed = true));
  Modelica.Mechanics.Translational.Components.Mass two(m = 0.5, s(fixed = true), v(start = -0.01, fixed = true));
"""
    joined = "  connect(one.flange_b, stack.flange_a);\n  connect(stack.flange_b, two.flange_a);\n"
    v = bench.run(tmp_path, bench.ELECTRICAL + SOURCE + BARE + declared, bench.WIRED + FED + joined)
    momentum = 0.3 * v["one.v"] + 0.5 * v["two.v"]
    assert v["one.v"][0] == 0.02
    assert v["two.v"][0] == -0.01
    assert np.abs(momentum - 0.001).max() < 1e-9
    assert np.ptp(v["two.v"]) > 1e-3


def test_a_mass_with_a_velocity_moves_the_stack_by_hand(tmp_path: Path) -> None:
    """In short circuit the velocity makes a charge: electrical and mechanical side are one."""
    declared = bench.ELECTRICAL + bench.WALL + BARE
    declared += "  Modelica.Mechanics.Translational.Components.Mass mass(m = 0.5, s(fixed = true), "
    declared += "v(start = 0.05, fixed = true));\n"
    joined = bench.WIRED + bench.HELD + "  connect(line.p, ground.p);\n  connect(mass.flange_a, stack.flange_b);\n"
    v = bench.run(tmp_path, declared, joined)
    assert np.ptp(v["stack.q"]) > 1e-6
    kinetic = 0.5 * 0.5 * (0.05**2 - v["mass.v"] ** 2)
    line = np.concatenate([[0], np.cumsum((20 * v["stack.pin_p.i"] ** 2)[:-1] * np.diff(v["time"]))])
    kept = v["stack.stored"] - v["stack.stored"][0] + v["stack.dissipated"] + line
    assert np.abs(kinetic - kept).max() < 5e-3 * kinetic.max()


def test_two_stacks_in_series_are_one_with_two_elements(tmp_path: Path) -> None:
    """Flange to flange with a small mass between them, electrically in parallel."""
    declared = LOAD + BARE + "  HystFMU.Actuators.Stack upper(withMass = false);\n"
    declared += (
        "  Modelica.Mechanics.Translational.Components.Mass between(m = 1e-3, s(fixed = true), v(fixed = true));\n"
    )
    joined = LOADED.replace("connect(stack.flange_b", "connect(upper.flange_b")
    joined += "  connect(stack.flange_b, between.flange_a);\n  connect(between.flange_b, upper.flange_a);\n"
    joined += "  connect(upper.pin_p, stack.pin_p);\n  connect(upper.pin_n, stack.pin_n);\n"
    apart = run(tmp_path, declared, joined)
    # two dampers of 20 in series are one of 10, the leads beside each other half the resistance
    whole = run(
        tmp_path,
        "  HystFMU.Actuators.Stack stack(withMass = false, n_series = 2, c = 10, resistance = 0.5);\n" + LOAD,
        LOADED,
    )
    assert np.abs(apart["mass.s"] - whole["mass.s"]).max() < 2e-3 * np.ptp(whole["mass.s"])
    assert np.abs(apart["line.i"] - whole["line.i"])[200:].max() < 0.02 * np.ptp(whole["line.i"][200:])


def test_two_stacks_in_parallel_are_one_with_two_elements(tmp_path: Path) -> None:
    declared = LOAD + BARE + "  HystFMU.Actuators.Stack beside(withMass = false);\n"
    ends = ("pin_p", "pin_n", "flange_a", "flange_b")
    joined = LOADED + "".join(f"  connect(beside.{end}, stack.{end});\n" for end in ends)
    apart = run(tmp_path, declared, joined)
    # the leads and dampers of two: half the resistance, twice the damping
    whole = "  HystFMU.Actuators.Stack stack(withMass = false, n_parallel = 2, c = 40, resistance = 0.5);\n"
    one = run(tmp_path, whole + LOAD, LOADED)
    assert np.abs(apart["mass.s"] - one["mass.s"]).max() < 1e-7 * np.ptp(one["mass.s"])
    assert np.abs(apart["line.i"] - one["line.i"]).max() < 1e-7 * np.ptp(one["line.i"])


def test_the_heat_warms_what_hangs_on_the_port(tmp_path: Path) -> None:
    declared = "  HystFMU.Actuators.Stack stack(useHeatPort = true);\n"
    declared += "  Modelica.Thermal.HeatTransfer.Components.HeatCapacitor body(C = 2, T(start = 300, fixed = true));\n"
    v = run(tmp_path, declared, "  connect(body.port, stack.heatPort);\n")
    assert v["body.T"][-1] > 300
    assert np.abs(2 * (v["body.T"] - 300) - v["stack.dissipated"]).max() < 1e-9
