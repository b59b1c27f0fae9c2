"""Ways to connect an actuator that other libraries make a trap: sources, grounds, flanges, stacks, initial states."""

from functools import cache

import bench
import numpy as np
import pytest

pytestmark = bench.needs_standard

# SineVoltage of version 4.0.0 calls an external "builtin" sin, which rumoca 0.10.2 does not run
SOURCE = "  Modelica.Electrical.Analog.Sources.SignalVoltage source;\n"
SINE = "  source.v = 50 + 40*sin(2*3.141592653589793*100*time);\n"
LATER = "  source.v = 50 + (if time < 0.005 then 0 else 40*sin(2*3.141592653589793*100*(time - 0.005)));\n"
GROUNDED = "  connect(source.n, ground.p);\n  connect(source.p, line.p);\n"
FED = SINE + GROUNDED
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


def fed(declared: str, joined: str = "") -> tuple[str, str]:
    """A circuit of source, line, stack and wall, and what else is given."""
    return bench.ELECTRICAL + SOURCE + bench.WALL + declared, bench.WIRED + FED + bench.HELD + joined


FLOATING = """
  connect(source.p, line.p);
  connect(line.n, stack.pin_p);
  connect(stack.pin_n, source.n);
  connect(stack.pin_p, ground.p);
"""
SECOND = "  HystFMU.Plants.Ground second;\n  Modelica.Electrical.Analog.Basic.Resistor between(R = 1e-3);\n"
UPPER = """
  HystFMU.Actuators.Stack upper(withMass = false);
  Modelica.Mechanics.Translational.Components.Mass between(m = 1e-3, s(fixed = true), v(fixed = true));
"""
ON_TOP = """
  connect(stack.flange_b, between.flange_a);
  connect(between.flange_b, upper.flange_a);
  connect(upper.pin_p, stack.pin_p);
  connect(upper.pin_n, stack.pin_n);
"""
ENDS = ("pin_p", "pin_n", "flange_a", "flange_b")
STEADY = "  HystFMU.Actuators.Stack stack(start = HystFMU.Types.Start.steady);\n"
MASSES = """
  Modelica.Mechanics.Translational.Components.Mass one(m = 0.3, s(fixed = true), v(start = 0.02, fixed = true));
  Modelica.Mechanics.Translational.Components.Mass two(m = 0.5, s(fixed = true), v(start = -0.01, fixed = true));
"""
THROWN = """
  Modelica.Mechanics.Translational.Components.Mass mass(m = 0.5, s(fixed = true), v(start = 0.05, fixed = true));
"""
BODY = "  Modelica.Thermal.HeatTransfer.Components.HeatCapacitor body(C = 2, T(start = 300, fixed = true));\n"


def double(more: str) -> tuple[str, str]:
    """One stack of two elements, with the lead and the damper of two stacks."""
    return fed(f"  HystFMU.Actuators.Stack stack(withMass = false, {more}, resistance = 0.5);\n" + LOAD, LOADED)


GROUPS = {
    "grounds": {
        "warm": fed(
            "  HystFMU.Actuators.Stack stack(useHeatPort = true);\n" + BODY, "  connect(body.port, stack.heatPort);\n"),
        "grounded": fed(STACK + SECOND, "  connect(between.p, stack.pin_n);\n  connect(second.pin, between.n);\n"),
        "floating": (bench.ELECTRICAL + SOURCE + bench.WALL + STACK, SINE + FLOATING + bench.HELD),
    },
    "starts": {
        "started": fed("  HystFMU.Actuators.Stack stack(v_start = 50);\n"),
        "steady": (
            bench.ELECTRICAL + SOURCE + bench.WALL + STEADY + LOAD.split("\n", 2)[2],
            bench.WIRED + LATER + GROUNDED + bench.HELD
            + "  connect(stack.flange_b, spring.flange_a);\n  connect(spring.flange_b, other.flange);\n",
        ),
        "free": (
            bench.ELECTRICAL + SOURCE + BARE + MASSES,
            bench.WIRED + FED
            + "  connect(one.flange_b, stack.flange_a);\n  connect(stack.flange_b, two.flange_a);\n",
        ),
        "thrown": (bench.ELECTRICAL + bench.WALL + BARE + THROWN,
            bench.WIRED + bench.HELD + "  connect(line.p, ground.p);\n  connect(mass.flange_a, stack.flange_b);\n"),
    },
    "series": {
        "apart": fed(BARE + UPPER + LOAD, LOADED.replace("connect(stack.flange_b", "connect(upper.flange_b") + ON_TOP),
        # two dampers of 20 in series are one of 10, the leads beside each other half the resistance
        "whole": double("n_series = 2, c = 10"),
    },
    "parallel": {
        "apart": fed(BARE + "  HystFMU.Actuators.Stack beside(withMass = false);\n" + LOAD,
            LOADED + "".join(f"  connect(beside.{end}, stack.{end});\n" for end in ENDS)),
        "whole": double("n_parallel = 2, c = 40"),
    },
}  # fmt: skip


@cache
def found(group: str) -> dict[str, dict[str, np.ndarray]]:
    """A period of the source."""
    return bench.beside(GROUPS[group], stop=0.01)


@pytest.mark.turn("actuators in Modelica")
@pytest.mark.some(1)
@pytest.mark.parametrize("group", GROUPS)
def test_the_balance_holds_in_every_circuit(group: str) -> None:
    for circuit, v in found(group).items():
        for stack in {n.split(".")[0] for n in v if n.endswith(".residual")}:
            supplied = np.abs(v[f"{stack}.supplied"]).max()
            assert supplied > 1e-6, circuit
            assert np.ptp(v[f"{stack}.residual"]) <= 1e-9 * supplied, circuit


@pytest.mark.stress
def test_a_source_with_offset_needs_no_start_value() -> None:
    """The stack begins at 0 V: the leads limit the current."""
    v = found("parallel")["whole"]
    assert v["stack.pin_p.i"][0] == pytest.approx(50 / 20.5, rel=1e-9)
    assert np.ptp(v["mass.s"]) > 1e-6


@pytest.mark.stress
def test_a_start_at_the_offset_does_not_jump() -> None:
    v = found("starts")["started"]
    assert abs(v["stack.pin_p.i"][0]) < 1e-9
    assert v["stack.flange_b.s"][0] == pytest.approx(26e-6 / 1.025 * (0.3 + 10 * 0.1) * 0.5, rel=1e-9)
    assert abs(np.diff(v["stack.flange_b.s"])[:5]).max() < 2e-8  # a jump would be of 1e-5


@pytest.mark.stress
def test_a_steady_start_is_in_equilibrium_with_the_load() -> None:
    """A spring is compressed from the first instant, under the voltage that the source has then."""
    v = found("starts")["steady"]
    still = v["time"] < 0.0049
    s = v["stack.flange_b.s"]
    assert s[0] > 5e-6
    assert np.ptp(s[still]) < 1e-6 * s[0]
    assert np.abs(v["stack.pin_p.i"][still]).max() < 1e-7
    # tension of the stack balances the spring: k (s - y) = -c s
    assert 4e7 * (s[0] - v["stack.hysteresis.y"][0]) == pytest.approx(-2e6 * s[0], rel=1e-6)


@pytest.mark.stress
def test_a_second_ground_changes_nothing() -> None:
    """Behind a resistor, because two ideal grounds at one node leave their currents open in any library."""
    v, w = (found("grounds")[n] for n in ("warm", "grounded"))
    assert np.abs(v["stack.flange_b.s"] - w["stack.flange_b.s"]).max() < 1e-12


@pytest.mark.stress
def test_a_floating_stack_has_no_hidden_ground() -> None:
    """Ground at the positive pin: the voltage across the stack is the same, its potentials are not."""
    v, w = (found("grounds")[n] for n in ("warm", "floating"))
    assert np.abs(w["stack.pin_p.v"]).max() < 1e-9
    assert np.abs(v["stack.v"] - w["stack.v"]).max() < 1e-6


@pytest.mark.stress
def test_without_a_wall_the_momentum_stays() -> None:
    """Two masses at the ends, one with a velocity: no mechanical ground, no hidden one either."""
    v = found("starts")["free"]
    momentum = 0.3 * v["one.v"] + 0.5 * v["two.v"]
    assert v["one.v"][0] == 0.02
    assert v["two.v"][0] == -0.01
    assert np.abs(momentum - 0.001).max() < 1e-9
    assert np.ptp(v["two.v"]) > 1e-3


@pytest.mark.stress
def test_a_mass_with_a_velocity_moves_the_stack_by_hand() -> None:
    """In short circuit the velocity makes a charge: electrical and mechanical side are one."""
    v = found("starts")["thrown"]
    assert np.ptp(v["stack.q"]) > 1e-6
    kinetic = 0.5 * 0.5 * (0.05**2 - v["mass.v"] ** 2)
    line = np.concatenate([[0], np.cumsum((20 * v["stack.pin_p.i"] ** 2)[:-1] * np.diff(v["time"]))])
    kept = v["stack.stored"] - v["stack.stored"][0] + v["stack.dissipated"] + line
    assert np.abs(kinetic - kept).max() < 5e-3 * kinetic.max()


@pytest.mark.stress
def test_two_stacks_in_series_are_one_with_two_elements() -> None:
    """Flange to flange with a small mass between them, electrically in parallel."""
    apart, whole = (found("series")[n] for n in ("apart", "whole"))
    assert np.abs(apart["mass.s"] - whole["mass.s"]).max() < 2e-3 * np.ptp(whole["mass.s"])
    assert np.abs(apart["line.i"] - whole["line.i"])[200:].max() < 0.02 * np.ptp(whole["line.i"][200:])


@pytest.mark.stress
def test_two_stacks_in_parallel_are_one_with_two_elements() -> None:
    apart, one = (found("parallel")[n] for n in ("apart", "whole"))
    assert np.abs(apart["mass.s"] - one["mass.s"]).max() < 1e-7 * np.ptp(one["mass.s"])
    assert np.abs(apart["line.i"] - one["line.i"]).max() < 1e-7 * np.ptp(one["line.i"])


@pytest.mark.stress
def test_the_heat_warms_what_hangs_on_the_port() -> None:
    v = found("grounds")["warm"]
    assert v["body.T"][-1] > 300
    assert np.abs(2 * (v["body.T"] - 300) - v["stack.dissipated"]).max() < 1e-9
