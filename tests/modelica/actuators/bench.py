"""An actuator among genuine parts of the Modelica Standard Library, and its energies as pins and flanges show them."""

import functools
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import compiled
import library
import numpy as np
import pytest
import simulate

Array = simulate.Array
STANDARD = Path(os.environ.get("HYSTFMU_DATA", Path(__file__).parents[4] / "shared" / "data")) / "msl"
LINKED = compiled.ROOT / "build" / "msl"
PARTS = (
    *("Complex.mo", "ModelicaServices", "Modelica/package.mo", "Modelica/package.order", "Modelica/Constants.mo"),
    *("Modelica/Icons.mo", "Modelica/Units.mo", "Modelica/Blocks", "Modelica/Math", "Modelica/Utilities"),
    *("Modelica/Electrical/package.mo", "Modelica/Electrical/Analog", "Modelica/Mechanics/package.mo"),
    *("Modelica/Mechanics/Translational", "Modelica/Thermal/package.mo", "Modelica/Thermal/HeatTransfer"),
)
needs_standard = pytest.mark.skipif(not STANDARD.exists(), reason=f"Modelica Standard Library absent: {STANDARD}")

ELECTRICAL = """
  Modelica.Electrical.Analog.Basic.Ground ground;
  Modelica.Electrical.Analog.Basic.Resistor line(R = 20);
"""
FEED = """
  model Feed "Grounded source of the voltage u, with its line"
    parameter Real R = 20;
    HystFMU.Interfaces.Pin p;
    HystFMU.Interfaces.Pin n;
    HystFMU.Interfaces.RealInput u;
  equation
    p.v = u + R*p.i;
    n.v = 0;
  end Feed;
"""
WALL = "  Modelica.Mechanics.Translational.Components.Fixed wall;\n"
WIRED = """
  connect(line.n, stack.pin_p);
  connect(stack.pin_n, ground.p);
"""
HELD = "  connect(wall.flange, stack.flange_a);\n"


@functools.cache
def roots() -> tuple[Path, ...]:
    """The library, and a folder with links to the parts of the Standard Library that the circuits use.

    The compiler takes five times as long to read the whole Standard Library.
    """
    if not STANDARD.exists():
        return (library.ROOT,)
    with compiled.alone(LINKED):
        for part in PARTS:
            link, target = LINKED / part, (STANDARD / part).resolve()
            if not link.exists():
                link.parent.mkdir(parents=True, exist_ok=True)
                link.unlink(missing_ok=True)
                link.symlink_to(target)
    return library.ROOT, LINKED


def run(
    declared: str, joined: str, stop: float = 0.02, step: float = 1e-5, tolerance: float = 1e-10
) -> dict[str, Array]:
    """Trajectories of a model of these parts, by name."""
    text = f"model Bench\n{declared}equation\n{joined}end Bench;\n"
    return simulate.solve_text(text, stop, step, tolerance, packages=roots()).values


def beside(
    circuits: Mapping[str, tuple[str, str]], stop: float, step: float = 1e-5, tolerance: float = 1e-10
) -> dict[str, dict[str, Array]]:
    """Trajectories of circuits that nothing joins, each a class of one model.

    Three or four of them take as long as two alone: most of the time goes into the classes that they share.  The time
    of a step grows faster than their number, though.

    Parameters
    ----------
    circuits : mapping of str to (str, str)
        Declarations and equations of each, by a name that is one in Modelica.
    stop, step, tolerance : float
        Seconds, those between two rows, and tolerance of the solver.

    Returns
    -------
    dict
        Trajectories of each circuit, by name, with the time.
    """
    parts = "".join(
        f"  model {name.capitalize()}\n{declared}  equation\n{joined}  end {name.capitalize()};\n"
        f"  {name.capitalize()} {name};\n"
        for name, (declared, joined) in circuits.items()
    )
    v = run(parts, "", stop, step, tolerance)
    return {
        name: {"time": v["time"], **{k.removeprefix(f"{name}."): x for k, x in v.items() if k.startswith(f"{name}.")}}
        for name in circuits
    }


def over(y: Array, x: Array) -> float:
    """Integral of y over x by the rule of trapezia."""
    return float(np.sum((y[1:] + y[:-1]) / 2 * np.diff(x)))


@dataclass(frozen=True)
class Values:
    """Parameters of an actuator that the energies need; the defaults are those of the library."""

    C: float = 6e-6
    share: float = 0.9
    stroke: float = 26e-6
    v_max: float = 100.0
    resistance: float = 1.0
    c: float = 20.0
    m: float = 0.02

    @property
    def d(self) -> float:
        return self.stroke / (self.share * self.C * self.v_max)


@dataclass(frozen=True)
class Energies:
    """Work and losses (J) between two instants; `loop` is that of v - d F over P, F the compression."""

    electrical: float
    mechanical: float  # out of the actuator
    loop: float
    others: float  # lost in leads and damping, and kept by the mass
    exchanged: float

    @property
    def rest(self) -> float:
        """What remains of the balance, in parts of the exchanged energy."""
        return (self.electrical - self.mechanical - self.loop - self.others) / self.exchanged


def energies(v: dict[str, Array], since: float, p: Values, stack: str = "stack") -> Energies:
    """Energies from the quantities at pins and flanges alone; P is what C leaves of the charge."""
    late = v["time"] >= since - 1e-9
    one = {k.removeprefix(f"{stack}."): x[late] for k, x in v.items() if k.startswith(f"{stack}.")}
    t, i, s = v["time"][late], one["pin_p.i"], one["flange_b.s"] - one["flange_a.s"]
    volts = one["pin_p.v"] - one["pin_n.v"]
    behind = volts - p.resistance * i
    P = one["q"] - (1 - p.share) * p.C * behind
    speed = one["inertia.v"]
    ceramic = -one["flange_a.f"] - p.c * speed
    power = np.abs(one["flange_b.f"] * np.gradient(one["flange_b.s"], t))
    exchanged = over(np.abs(volts * i) + power, t)
    damped = over(p.resistance * i**2 + p.c * speed**2, t)
    moving = p.m * (speed[-1] ** 2 - speed[0] ** 2) / 2
    into = over(one["flange_b.f"], one["flange_b.s"]) + over(one["flange_a.f"], one["flange_a.s"])
    assert np.ptp(s) > 0
    return Energies(over(volts * i, t), -into, over(behind + p.d * ceramic, P), damped + moving, exchanged)
