"""The file of the actuator of a package, and of an example that moves a mass with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.model import Model
from hystfmu.modelica.actuator.sheet import Mechanics, Sheet, mechanics
from hystfmu.modelica.actuator.slot import METRES, VOLTS, Slot, slot
from hystfmu.modelica.layout import placed
from hystfmu.modelica.literals import number, string

ACTUATOR = ("Actuator", "ActuatorExample")  # classes in a package
RESONANCE = 3000.0  # Hz, about, of the load on the actuator of the example
ROWS, HELD = 400, 100  # of the ramp that shows the stroke; rows that each end is held


@dataclass(frozen=True)
class Made:
    """An actuator in SI units: its slot, its mechanics, the voltages of its data."""

    slot: Slot
    volt: float
    metre: float
    low: float
    high: float
    mechanics: Mechanics

    @property
    def v_start(self) -> float:
        """Voltage at which the memory rests."""
        return (self.slot.rest - self.slot.shift) / self.slot.gain * self.volt


def refusal(model: Model) -> str:
    """Why a model has no actuator, as the end of a sentence, or ""."""
    graph = model.graph
    if len(graph.inputs) != 1 or len(graph.outputs) != 1:
        return "the model must have one input and one output"
    units = graph.inputs[0].unit, graph.outputs[0].unit
    if units[0] not in VOLTS or units[1] not in METRES:
        return f"the model must map a voltage in {', '.join(VOLTS)} to a length in {', '.join(METRES)}, not {units}"
    if slot(graph) is None:
        return f"HystFMU.Actuators.Hysteresis has no class for a model of kind {model.key!r} with these blocks"
    return ""


def actuator_files(model: Model, within: str, told: str, values: Mapping[str, float] | None) -> dict[str, str]:
    """The files of the actuator by class; none of a model that is no actuator, unless a data sheet asks for it.

    Parameters
    ----------
    model : Model
    within : str
        Name of the package.
    told : str
        Fit quality and provenance as HTML.
    values : mapping of (str, float) or None
        Data sheet; None: none is known.

    Raises
    ------
    InputError
        A data sheet of a model that is no actuator, or one that no stack can have.
    """
    why = refusal(model)
    if why and values is not None:
        raise InputError(f"a data sheet makes an actuator, and {why}")
    if why:
        return {}
    sheet = Sheet.of(values or {})
    part, shown = ACTUATOR
    return {part: actuator(model, part, within, sheet, told), shown: actuator_example(model, shown, within, part, sheet)}


def made(model: Model, sheet: Sheet) -> Made:
    """Fold a model that `refusal` does not refuse."""
    found = slot(model.graph)
    assert found is not None
    volt, metre = VOLTS[model.graph.inputs[0].unit], METRES[model.graph.outputs[0].unit]
    span = model.provenance.get("span_u")
    low, high = (float(v) for v in span) if span else (-1.0, 1.0)
    ramp = np.concatenate([np.full(HELD, low), np.linspace(low, high, ROWS), np.full(HELD, high)])
    y = model.predict(ramp)
    stroke = abs(float(y[-1] - y[HELD - 1])) * metre
    f_n, zeta = (model.fit.get(k) for k in ("f_n", "zeta"))
    dynamics = any(n.type == "transfer_function" for n in model.graph.nodes)
    known = (f_n, zeta) if dynamics else (None, None)
    return Made(found, volt, metre, low * volt, high * volt, mechanics(sheet, (high - low) * volt, stroke, *known))


def actuator(model: Model, name: str, within: str, sheet: Sheet, history: str = "") -> str:
    """The file of the actuator, without its mark.

    Parameters
    ----------
    model : Model
        One that `refusal` does not refuse.
    name, within : str
        Name of the class and of its package.
    sheet : Sheet
        Data sheet; what it does not say is assumed, and the documentation says so.
    history : str
        Fit quality and provenance as HTML.

    Raises
    ------
    InputError
        The data sheet gives more work than it takes.
    """
    a = made(model, sheet)
    s, p = a.slot, a.mechanics
    scaling = {
        "gain": s.gain / a.volt,
        "shift": s.shift,
        "scale": s.scale * a.metre,
        "offset": s.offset * a.metre,
    }
    own = [f"{k} = {v}" for k, v in s.values.items()] + [f"{k} = {number(v)}" for k, v in scaling.items()]
    values = {k: number(getattr(p, k)) for k in ("v_max", "stroke", "C", "k", "m", "c", "share")}
    values |= {"withMass": "false" if p.f_n is None else "true", "v_start": number(a.v_start)}
    given = [f"{k} = {v}" for k, v in values.items()]
    own.insert(0, f"u_start = {values['v_start']}")
    given.append(f"redeclare HystFMU.Actuators.Hysteresis.{s.name} hysteresis({', '.join(own)})")
    modifiers = ",\n    ".join(given)
    return f"""within {within};
model {name} "Piezo actuator with the identified hysteresis, in SI units"
  extends HystFMU.Actuators.BaseClasses.Piezo(
    {modifiers});
  annotation (Documentation(info = {string(_documentation(model, a, sheet, within, history))}));
end {name};
"""


def _documentation(model: Model, a: Made, sheet: Sheet, within: str, history: str) -> str:
    p = a.mechanics
    assumed = []
    if sheet.stroke is None:
        assumed.append("a stiffness of 2e7 N/m in short circuit")
    if sheet.capacitance is None:
        assumed.append("a capacitance that makes the square of the coupling factor 0.5")
    if p.f_n is None:
        assumed.append("no moving mass")
    limits = [f"identified from {a.low:g} to {a.high:g} V"]
    limits += [f"{text} is left out" for text in a.slot.left_out]
    limits += [f"assumed, because neither data nor data sheet say it: {text}" for text in assumed]
    return (
        f"<html><p><b>Equation:</b> that of HystFMU.Actuators.BaseClasses.Piezo; in its slot "
        f"HystFMU.Actuators.Hysteresis.{a.slot.name}.</p>{history}"
        f"<p><b>Source:</b> a model of kind {escape(model.key)}; the rest from the data sheet.</p>"
        f"<p><b>Limitations:</b> {'; '.join(limits)}.</p>"
        f'<p><b>Example:</b> <a href="modelica://{within}.ActuatorExample">ActuatorExample</a>.</p>'
        f'<p><b>See also:</b> <a href="modelica://HystFMU.Actuators.BaseClasses.Piezo">HystFMU.Actuators.BaseClasses.Piezo'
        f"</a>.</p></html>"
    )


def actuator_example(model: Model, name: str, within: str, of: str, sheet: Sheet) -> str:
    """The file of an example: drive, actuator, mass and spring, over the range of the data.

    Parameters
    ----------
    model, within, sheet
        As in `actuator`.
    name, of : str
        Name of the example and of the actuator.
    """
    a = made(model, sheet)
    p = a.mechanics
    middle, half = (a.high + a.low) / 2, (a.high - a.low) / 2
    frequency = 50.0
    limits = f"gain = 1, v_min = {number(a.low)}, v_max = {number(a.high)}, v_start = {number(a.v_start)}"
    signal = f"amplitude = {number(half)}, offset = {number(middle)}, frequency = {frequency}, decay = {frequency / 2}"
    w = 2 * np.pi * RESONANCE
    load = f"m = {number(p.k / w**2)}, c = {number(0.2 * p.k / w)}, k = {number(0.02 * p.k)}"
    lines = [
        f"  HystFMU.Sources.DecayingSine command({signal}) annotation ({placed(-90, 0)});",
        f"  HystFMU.Actuators.VoltageDrive drive({limits}) annotation ({placed(-50, 0)});",
        f"  {of} actuator(withMass = false) annotation ({placed(20, 0)});",
        f"  HystFMU.Plants.Ground ground annotation ({placed(-10, -60)});",
        f"  HystFMU.Plants.Fixed fixed annotation ({placed(-50, -80)});",
        f"  HystFMU.Plants.SpringMassLoad load({load}) annotation ({placed(70, 0)});",
        "equation",
        *(_joined(*row) for row in _JOINED),
        '  annotation (experiment(StopTime = 0.04, Interval = 2e-4, Tolerance = 1e-9), Documentation(info = "<html>',
        "<p>A voltage drive, the actuator, and a mass on a spring. The load is joined rigidly, so that its mass stands "
        "for that of the actuator: <code>withMass = false</code>.</p>",
        f'<p><b>See also:</b> <a href=\\"modelica://{within}.{of}\\">{of}</a>.</p>',
        '</html>"));',
        f"end {name};\n",
    ]
    text = "The actuator moves a mass on a spring"
    return "\n".join([f"within {within};", f'model {name} "{text}"', "  extends HystFMU.Icons.Example;", *lines])


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
