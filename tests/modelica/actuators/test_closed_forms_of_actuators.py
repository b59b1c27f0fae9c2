"""Closed forms: data sheet, bender, amplifier of flexures, limits of the drives."""

import bench
import numpy as np
import pytest
import simulate

pytestmark = bench.needs_standard

SLOT = "HystFMU.Actuators.Hysteresis.PrandtlIshlinskii hysteresis"


def linear(scale: float, v_max: float) -> str:
    """A slot without hysteresis that gives the stroke `scale` at v_max."""
    return f"redeclare {SLOT}(n = 1, w0 = 1, r = {{1}}, w = {{0}}, gain = {1 / v_max!r}, scale = {scale!r})"


def held_at(volts: float, actuator: str, more: str = "", joined: str = "") -> tuple[str, str]:
    declared = bench.ELECTRICAL + bench.WALL + f"  HystFMU.Actuators.{actuator};\n" + more
    declared += f"  Modelica.Electrical.Analog.Sources.ConstantVoltage source(V = {volts!r});\n"
    fed = "  connect(source.n, ground.p);\n  connect(source.p, line.p);\n"
    return declared, bench.WIRED + bench.HELD + fed + joined


def resonance(t: np.ndarray, s: np.ndarray, rest: float) -> float:
    """Frequency of a decaying oscillation about its rest, from its crossings."""
    x = s - rest
    up = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    at = t[up] - x[up] * (t[up + 1] - t[up]) / (x[up + 1] - x[up])
    return float((len(at) - 1) / (at[-1] - at[0]))


@pytest.mark.turn("actuators in Modelica")
def test_a_stack_gives_what_its_data_sheet_says() -> None:
    """Stroke, capacitance and resonance without load, force when blocked."""
    stack = f"DataSheetStack stack({linear(38e-6, 120)}, start = HystFMU.Types.Start.steady)"
    v = bench.run(*held_at(120.0, stack), stop=1e-3)
    assert v["stack.flange_b.s"][-1] == pytest.approx(38e-6, rel=1e-6)
    assert v["stack.q"][-1] == pytest.approx(1.6 * 3.1e-6 * 120, rel=1e-6)
    blocked = "  Modelica.Mechanics.Translational.Components.Fixed other;\n"
    stack = f"DataSheetStack stack({linear(38e-6, 120)}, withMass = false)"
    v = bench.run(*held_at(120.0, stack, blocked, "  connect(other.flange, stack.flange_b);\n"), stop=5e-3)
    assert abs(v["stack.flange_b.f"][-1]) == pytest.approx(900, rel=1e-6)


@pytest.mark.stress
def test_a_stack_resonates_where_its_data_sheet_says() -> None:
    """In short circuit, far below what the leads and the relaxation pass: a step of 1 V."""
    stack = f"DataSheetStack stack({linear(38e-6, 120)}, data(f_n = 4e3), resistance = 0.05, tau = 5e-7)"
    declared, joined = held_at(1.0, stack)
    v = bench.run(declared.replace("R = 20", "R = 0.05"), joined, stop=2e-3, step=1e-6, tolerance=1e-8)
    assert resonance(v["time"], v["stack.flange_b.s"], 38e-6 / 120) == pytest.approx(
        4e3 * np.sqrt(1 - 0.02**2), rel=5e-3
    )


@pytest.mark.stress
def test_a_data_sheet_that_gives_energy_away_is_refused() -> None:
    """The small-signal capacitance of a real data sheet cannot feed its own stroke and force."""
    declared, joined = held_at(1.0, "DataSheetStack stack(data(C_ratio = 1, C_small = 2e-6))")
    with pytest.raises(AssertionError, match="more work than it takes"):
        bench.run(declared, joined, 1e-3, 1e-4)


@pytest.mark.stress
def test_a_bender_bends_as_a_beam_does() -> None:
    """Tip deflection, first resonance, capacitance of a bimorph of 40 x 10 x 0.6 mm."""
    L, b, h, d31, E, eps = 40e-3, 10e-3, 0.6e-3, 190e-12, 62e9, 1.6e-8
    tip = 3 * d31 * L**2 * 60 / h**2
    bender = f"Bender stack({linear(tip, 60)}, zeta = 0.05)"
    declared, joined = held_at(30.0, bender)
    v = bench.run(declared.replace("R = 20", "R = 2000"), joined, stop=0.2, step=2e-5, tolerance=1e-9)
    assert v["stack.flange_b.s"][-1] == pytest.approx(tip / 2, rel=1e-4)
    assert v["stack.q"][-1] == pytest.approx(4 * eps * b * L / h * 30, rel=1e-4)
    # first mode of a cantilever: 1.8751^2 sqrt(E I/(rho A L^4)) / 2 pi
    first = 1.8751**2 * np.sqrt(E * h**2 / (12 * 7800 * L**4)) / (2 * np.pi)
    assert resonance(v["time"], v["stack.flange_b.s"], tip / 2) == pytest.approx(first, rel=5e-3)


@pytest.mark.stress
def test_an_amplifier_of_flexures_balances_forces_and_energy() -> None:
    """At rest against a spring: the closed form of lever, flexures and stack, and no work lost in it."""
    N, k_in, k_out, k, load = 5.0, 2e6, 1e6, 4e7, 1e4
    y = 26e-6 / 100 * 80
    declared, joined = held_at(
        80.0,
        f"Stack stack({linear(26e-6, 100)}, withMass = false, start = HystFMU.Types.Start.rest)",
        """  HystFMU.Actuators.FlexureAmplifier lever;
  Modelica.Mechanics.Translational.Components.Mass mass(m = 0.02, s(fixed = true), v(fixed = true));
  Modelica.Mechanics.Translational.Components.SpringDamper spring(c = 1e4, d = 40);
  Modelica.Mechanics.Translational.Components.Fixed other;
""",
        """  connect(stack.flange_b, lever.flange_a);
  connect(lever.support, wall.flange);
  connect(lever.flange_b, mass.flange_a);
  connect(mass.flange_b, spring.flange_a);
  connect(spring.flange_b, other.flange);
""",
    )
    v = bench.run(declared, joined, stop=0.05)
    end = {n: x[-1] for n, x in v.items()}
    out = end["lever.flange_b.s"]
    force = load * out
    s_in = (out + force / k_out) / N
    push = -end["stack.elastic.F"]
    assert push == pytest.approx(k_in * s_in + N * force, rel=1e-6)
    assert end["stack.flange_b.s"] == pytest.approx(s_in, rel=1e-6)
    d = 26e-6 / (0.9 * 6e-6 * 100)
    assert s_in == pytest.approx(y * (1 - d * push / 80) - push / k, rel=1e-6)
    assert end["lever.support.f"] == pytest.approx(-(push - force), rel=1e-6)


def drive(kind: str, command: str, stop: float, declared: str = "", joined: str = "") -> dict:
    """A drive on a capacitor of 6 uF, or what else is given."""
    load = declared or "  Modelica.Electrical.Analog.Basic.Capacitor load(C = 6e-6, v(start = 0, fixed = true));\n"
    joined = joined or "  connect(drive.pin_p, load.p);\n  connect(load.n, ground.p);\n"
    parts = f"  Modelica.Electrical.Analog.Basic.Ground ground;\n  HystFMU.Actuators.{kind} drive;\n{load}"
    joined = f"  drive.u = {command};\n  connect(drive.pin_n, ground.p);\n{joined}"
    return bench.run(parts, joined, stop=stop)


@pytest.mark.stress
def test_a_voltage_drive_keeps_its_limits() -> None:
    """A step to twice its range: slew rate without load, then the current into 6 uF, then the least upper limit."""
    v = drive("VoltageDrive", "2.0", 0.02)
    t, early = v["time"], 2e-5
    assert np.diff(v["drive.v"])[t[1:] < early].max() / 1e-5 == pytest.approx(1e6, rel=1e-6)
    assert np.abs(v["drive.i"]).max() <= 0.2 * (1 + 1e-9)
    charging = (t > 1e-3) & (t < 3e-3)
    assert np.polyfit(t[charging], v["load.v"][charging], 1)[0] == pytest.approx(0.2 / 6e-6, rel=1e-6)
    assert v["load.v"][-1] == pytest.approx(130, rel=1e-6)


@pytest.mark.stress
def test_a_charge_drive_delivers_a_charge() -> None:
    v = drive("ChargeDrive", "0.5", 0.02)
    assert np.abs(np.diff(v["drive.q"])).max() <= 0.2 * 1e-5 * (1 + 1e-9)
    assert v["load.v"][-1] == pytest.approx(0.5 * 6e-4 / 6e-6, rel=1e-5)


@pytest.mark.stress
def test_charge_drive_shows_a_tenth_of_the_hysteresis() -> None:
    """Largest width of the loop over the command, from the example."""
    v = simulate.run("HystFMU.Examples.ChargeDrive").instants()
    late = v["time"] >= 0.05 - 1e-9
    width = {}
    for stack in ("underVoltage", "underCharge"):
        x, y = v["command.r"][late], v[f"{stack}.flange_b.s"][late]
        up = np.gradient(x) > 0
        grid = np.linspace(-0.7, 0.7, 50)
        rise, fall = (y[m][np.argsort(x[m])] for m in (up, ~up))
        branches = [np.interp(grid, np.sort(x[m]), b) for m, b in ((up, rise), (~up, fall))]
        width[stack] = float(np.abs(branches[1] - branches[0]).max() / np.ptp(y))
    print(width)
    assert width["underVoltage"] > 0.15
    assert width["underCharge"] < 0.12 * width["underVoltage"]
