"""The example of an exported actuator: a drive, the actuator, a mass and a spring."""

from __future__ import annotations

import numpy as np

from hystfmu.modelica.actuator.made import Made
from hystfmu.modelica.layout import placed
from hystfmu.modelica.literals import number

RESONANCE = 3000.0  # Hz, about, of the load on an actuator without a mass
BANDWIDTH, MARGIN = 1e4, 4.0  # of a current drive: rad/s; its voltage over that of the command
FREQUENCY = 50.0  # Hz of the command, at most a tenth of the resonance


def actuator_example(a: Made, name: str, within: str, of: str) -> str:
    """Return the file of an example: drive, actuator, mass and spring, over the range of the data.

    Parameters
    ----------
    a : Made
        The actuator.
    name, within, of : str
        Name of the example, of its package, and of the class of the actuator.
    """
    p = a.mechanics
    middle, half = (a.high + a.low) / 2, (a.high - a.low) / 2
    frequency = min(FREQUENCY, (p.f_n or RESONANCE) / 10)
    signal = f"amplitude = {number(half)}, offset = {number(middle)}, frequency = {frequency}, decay = {frequency / 2}"
    drive = _drive(a, frequency)
    w = 2 * np.pi * RESONANCE
    if p.m is None:
        load = f"m = {number(p.k / w**2)}, c = {number(0.2 * p.k / w)}, k = {number(0.02 * p.k)}, fixedStart = true"
        moved = "The actuator has no mass, because its mode is not known. So the load has the only mass."
    else:
        load = f"m = {number(p.m)}, c = 0.0, k = {number(0.02 * p.k)}"
        moved = "The mass of the load equals the moving mass of the actuator, and is joined rigidly to the actuator."
    period = f"StopTime = {number(2 / frequency)}, Interval = {number(0.01 / frequency)}"
    lines = [
        f"  HystFMU.Sources.DecayingSine command({signal}) annotation ({placed(-90, 0)});",
        f"  HystFMU.Actuators.{drive} annotation ({placed(-50, 0)});",
        f"  {of} actuator annotation ({placed(20, 0)});",
        f"  HystFMU.Plants.Ground ground annotation ({placed(-10, -60)});",
        f"  HystFMU.Plants.Fixed fixed annotation ({placed(-50, -80)});",
        f"  HystFMU.Plants.SpringMassLoad load({load}) annotation ({placed(70, 0)});",
        "equation",
        *(_joined(*row) for row in _JOINED),
        f'  annotation (experiment({period}, Tolerance = 1e-9), Documentation(info = "<html>',
        f"<p>A drive, the actuator, and a mass on a spring. {moved}</p>",
        f'<p><b>See also:</b> <a href=\\"modelica://{within}.{of}\\">{of}</a>.</p>',
        '</html>"));',
        f"end {name};\n",
    ]
    text = "The actuator moves a mass on a spring"
    return "\n".join([f"within {within};", f'model {name} "{text}"', "  extends HystFMU.Icons.Example;", *lines])


def _drive(a: Made, frequency: float) -> str:
    """Return class, name and values of the drive.

    A voltage drive has the range of the data. A current drive is fast and strong enough for this range.
    """
    p = a.mechanics
    if a.form.unit == "V":
        limits = f"v_min = {number(a.low)}, v_max = {number(a.high)}, v_start = {number(a.start)}"
        return f"VoltageDrive drive(gain = 1, {limits})"
    impedance = p.resistance + 2 * np.pi * frequency * p.C
    values = {"v_max": MARGIN * impedance * max(abs(a.low), abs(a.high)), "K": BANDWIDTH * p.C}
    return f"CurrentDrive drive(gain = 1, {', '.join(f'{k} = {number(v)}' for k, v in values.items())})"


_BLUE, _GREEN, _NAVY = "{0, 0, 255}", "{0, 127, 0}", "{0, 0, 127}"
_JOINED = (
    ("command.r", "drive.u", "{-79, 0}, {-61, 0}", _NAVY),
    ("drive.pin_p", "actuator.pin_p", "{-39, 5}, {9, 5}", _BLUE),
    ("drive.pin_n", "actuator.pin_n", "{-39, -5}, {9, -5}", _BLUE),
    ("drive.pin_n", "ground.pin", "{-39, -5}, {-10, -5}, {-10, -49}", _BLUE),
    ("fixed.flange", "actuator.flange_a", "{-39, -80}, {20, -80}, {20, -11}", _GREEN),
    ("actuator.flange_b", "load.flange", "{31, 0}, {59, 0}", _GREEN),
)


def _joined(a: str, b: str, points: str, colour: str) -> str:
    return f"  connect({a}, {b}) annotation (Line(points = {{{points}}}, color = {colour}));"
