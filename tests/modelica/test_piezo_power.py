"""Power of the piezo stack among genuine parts of the Modelica Standard Library: what goes in comes out or is lost.

Everything is counted from outside, at pins and flanges, and the losses from the plays themselves.
"""

from __future__ import annotations

import os
from pathlib import Path

import library
import numpy as np
import pytest
import simulate

STANDARD = Path(os.environ.get("HYSTFMU_DATA", Path(__file__).parents[3] / "shared" / "data")) / "msl"
SETTLED = 1e-3  # s
SEED = int(np.random.default_rng().integers(2**31))

pytestmark = pytest.mark.skipif(not STANDARD.exists(), reason=f"Modelica Standard Library absent: {STANDARD}")

PARTS = """
  Modelica.Electrical.Analog.Basic.Ground ground;
  Modelica.Electrical.Analog.Basic.Resistor line(R = 20);
  Modelica.Mechanics.Translational.Components.Fixed wall;
  Modelica.Mechanics.Translational.Components.Mass mass(m = 0.5, s(fixed = true), v(fixed = true));
  Modelica.Mechanics.Translational.Components.SpringDamper spring(c = 2e6, d = 800);
  Modelica.Mechanics.Translational.Components.Fixed other;
"""
JOINED = """
  connect(line.n, stack.pin_p);
  connect(stack.pin_n, ground.p);
  connect(wall.flange, stack.flange_a);
  connect(stack.flange_b, mass.flange_a);
  connect(mass.flange_b, spring.flange_a);
  connect(spring.flange_b, other.flange);
"""


def run(tmp_path: Path, declared: str, joined: str, step: float, since: float = SETTLED) -> dict[str, np.ndarray]:
    """Simulate a model of these parts at a fine output interval."""
    file = tmp_path / "Bench.mo"
    file.write_text(f"model Bench\n{declared}equation\n{joined}end Bench;\n")
    out = tmp_path / "out.npz"
    complaint = simulate.rumoca(file, "Bench", "0.02", repr(step), "1e-10", out, packages=(library.ROOT, STANDARD))
    assert not complaint, complaint
    with np.load(out) as found:
        late = found["time"] >= since  # the source begins with a jump, which no output interval resolves
        return {k: found[k][late] for k in found.files}


def energies(v: dict[str, np.ndarray], share: float = 0.5, stack: str = "stack") -> dict[str, float]:
    """Electrical and mechanical work, stored energy and losses of a stack with its defaults (J), over the whole run."""
    t = v["time"]

    def over(y: np.ndarray, x: np.ndarray) -> float:
        return float(np.sum((y[1:] + y[:-1]) / 2 * np.diff(x)))

    def value(name: str) -> np.ndarray:
        return v[f"{stack}.{name}"]

    i, volts = value("pin_p.i"), value("pin_p.v") - value("pin_n.v")
    work = {
        "electrical": over(volts * i, t),
        "mechanical": over(value("flange_b.f"), value("flange_b.s")) + over(value("flange_a.f"), value("flange_a.s")),
    }
    C, v_max, k, w0, w = 2e-6, 100.0, 1e7, 0.3, 0.1
    e = value("e") / v_max
    z = np.array([value(f"hysteresis.z[{j}]") for j in range(1, 11)])
    unit = share * C * v_max**2
    behind = volts - 1.0 * i
    stored = (1 - share) * C * behind**2 / 2 + value("flange_b.f") ** 2 / (2 * k)
    stored = stored + unit * (w0 * e**2 / 2 + w * (z**2).sum(axis=0) / 2)
    d = 20e-6 / (share * C * v_max)
    P = share * C * v_max * (w0 * e + w * z.sum(axis=0))
    lag = behind + d * value("flange_b.f") - value("e")
    lost = over(1.0 * i**2, t) + over(lag, P) + unit * w * sum(over(e - row, row) for row in z)
    return work | {"stored": float(stored[-1] - stored[0]), "lost": lost}


def test_work_is_stored_or_lost(tmp_path: Path) -> None:
    """Two tones between source and mass, at pins and flanges of the standard library."""
    sources = """
  Modelica.Electrical.Analog.Sources.SineVoltage source(V = 60, f = 100, offset = 20);
  Modelica.Electrical.Analog.Sources.SineVoltage second(V = 30, f = 370);
  HystFMU.Plants.PiezoStack stack;
"""
    wires = "  connect(source.n, ground.p);\n  connect(second.n, source.p);\n  connect(second.p, line.p);\n"
    v = run(tmp_path, sources + PARTS, wires + JOINED, step=1e-6)
    found = energies(v)
    exchanged = np.abs(np.diff(v["stack.q"])) @ np.abs(v["stack.v"][1:])
    rest = found["electrical"] + found["mechanical"] - found["stored"] - found["lost"]
    print({k: f"{x:.4g} J" for k, x in found.items()}, f"exchanged {exchanged:.4g} J, rest {rest / exchanged:.1e}")
    assert found["lost"] > 0.01 * exchanged
    assert abs(rest) <= 1e-6 * exchanged


@pytest.mark.parametrize("draw", range(3))
def test_no_random_input_gets_energy_out(draw: int, tmp_path: Path) -> None:
    """Voltages and forces of random tones: what is lost is not negative."""
    rng = np.random.default_rng([SEED, draw])
    f, a, p = (rng.uniform(lo, hi, 4).tolist() for lo, hi in ((20, 600), (5, 50), (-3, 3)))
    tones = [
        f"  Modelica.Electrical.Analog.Sources.SineVoltage s{k}(V = {a[k]!r}, f = {f[k]!r}, phase = {p[k]!r});\n"
        for k in range(3)
    ]
    push = f"""  Modelica.Mechanics.Translational.Sources.Force push;
  HystFMU.Sources.DecayingSine force(amplitude = {8 * a[3]!r}, frequency = {f[3]!r}, decay = 0);
  HystFMU.Plants.PiezoStack stack;
"""
    wires = """  connect(s0.n, ground.p);
  connect(s1.n, s0.p);
  connect(s2.n, s1.p);
  connect(s2.p, line.p);
  connect(force.r, push.f);
  connect(push.flange, mass.flange_b);
"""
    v = run(tmp_path, "".join(tones) + push + PARTS, wires + JOINED, step=2e-6)
    found = energies(v)
    exchanged = np.abs(np.diff(v["stack.q"])) @ np.abs(v["stack.v"][1:])
    assert found["lost"] >= 0, (SEED, draw)
    rest = found["electrical"] + found["mechanical"] - found["stored"] - found["lost"]
    assert abs(rest) <= 2e-5 * exchanged, (SEED, draw)


CIRCUITS = {
    "offset": (
        "  Modelica.Electrical.Analog.Sources.SineVoltage source(V = 40, f = 50, offset = 50);\n"
        "  HystFMU.Plants.PiezoStack stack;\n",
        "  connect(source.n, ground.p);\n  connect(source.p, line.p);\n",
    ),
    "started": (
        "  Modelica.Electrical.Analog.Sources.SineVoltage source(V = 40, f = 50, offset = 50);\n"
        "  HystFMU.Plants.PiezoStack stack(v_start = 50);\n",
        "  connect(source.n, ground.p);\n  connect(source.p, line.p);\n",
    ),
    "drive": (
        "  HystFMU.Plants.VoltageDrive source;\n"
        "  HystFMU.Sources.DecayingSine command(amplitude = 0.5, frequency = 50);\n"
        "  HystFMU.Plants.PiezoStack stack;\n",
        "  connect(command.r, source.u);\n  connect(source.pin_n, ground.p);\n  connect(source.pin_p, line.p);\n",
    ),
    "parallel": (
        "  Modelica.Electrical.Analog.Sources.SineVoltage source(V = 40, f = 50);\n"
        "  HystFMU.Plants.PiezoStack stack;\n  HystFMU.Plants.PiezoStack beside;\n",
        "  connect(source.n, ground.p);\n  connect(source.p, line.p);\n  connect(beside.pin_p, stack.pin_p);\n"
        "  connect(beside.pin_n, stack.pin_n);\n  connect(beside.flange_a, stack.flange_a);\n"
        "  connect(beside.flange_b, stack.flange_b);\n",
    ),
}


@pytest.mark.parametrize("circuit", CIRCUITS)
def test_parts_connect_without_a_trap(circuit: str, tmp_path: Path) -> None:
    """A source with offset, a start voltage, the amplifier with a ground of its own, two stacks side by side."""
    declared, wires = CIRCUITS[circuit]
    v = run(tmp_path, declared + PARTS, wires + JOINED, step=1e-5, since=0.0)
    assert np.ptp(v["mass.s"]) > 1e-6
    if circuit == "started":  # at rest under 50 V: nothing jumps
        assert abs(v["stack.pin_p.i"][0]) < 1e-9
        assert abs(v["stack.e"][0] - 50) < 1e-9
    if circuit == "parallel":
        assert np.abs(v["beside.stroke"] - v["stack.stroke"]).max() < 1e-15


def test_two_stacks_in_series_add_their_strokes(tmp_path: Path) -> None:
    """Flange to flange with a small mass between them, electrically in parallel."""
    declared = """
  Modelica.Electrical.Analog.Sources.SineVoltage source(V = 40, f = 50);
  HystFMU.Plants.PiezoStack stack;
  HystFMU.Plants.PiezoStack upper;
  Modelica.Mechanics.Translational.Components.Mass between(m = 0.01, s(fixed = true), v(fixed = true));
"""
    wires = """
  connect(source.n, ground.p);
  connect(source.p, line.p);
  connect(upper.pin_p, stack.pin_p);
  connect(upper.pin_n, stack.pin_n);
  connect(between.flange_b, upper.flange_a);
  connect(upper.flange_b, mass.flange_a);
"""
    joined = JOINED.replace("connect(stack.flange_b, mass.flange_a)", "connect(stack.flange_b, between.flange_a)")
    v = run(tmp_path, declared + PARTS, wires + joined, step=1e-5)
    both = v["stack.stroke"] + v["upper.stroke"] + (v["stack.F"] + v["upper.F"]) / 1e7
    assert np.abs(both - v["mass.s"]).max() < 1e-9 * 1e-3 + 1e-6 * np.ptp(v["mass.s"])
    assert np.ptp(v["stack.stroke"]) > 1e-6
