"""Conversion of an identified model to an actuator, and its files: the class with its parameters, and an example."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hystfmu.base import Array, InputError, escape
from hystfmu.graph import Graph, Node
from hystfmu.model import Model
from hystfmu.modelica import classes
from hystfmu.modelica.actuator.chain import bouc_wen, chain, preisach, temperatures, warm
from hystfmu.modelica.actuator.mechanics import FORMS, Form, Mechanics, Mode, Sheet, mechanics
from hystfmu.modelica.actuator.operators import magnetic, network, operator
from hystfmu.modelica.actuator.slot import Slot, static_gain
from hystfmu.modelica.layout import placed
from hystfmu.modelica.literals import class_text, information, link, number, string
from hystfmu.modelica.measures import si
from hystfmu.modelica.record import span

LINEAR = ("transfer_function", "delay")  # blocks that the mechanics of the actuator replace


def fold(graph: Graph, h: float) -> Slot | None:
    """Return the actuator hysteresis of a model; None if the library has no class for this hysteresis.

    Parameters
    ----------
    graph : Graph
        Graph of an identified model.
    h : float
        Step of the model (s).
    """
    beside = preisach(graph, h) or bouc_wen(graph, h)
    return beside or next((found for of in (warm, chain, operator, magnetic, network) if (found := of(graph))), None)


def why_not(graph: Graph) -> str:
    """Return the reason why no hysteresis class of the library represents a graph, as the end of a sentence."""
    for n in graph.nodes:
        if n.block.family != "operators" and n.type not in LINEAR and n.block.of("state"):
            return f"the slot takes only static models, but the block {n.type} has dynamics"
        if n.block.parameter("memory") and classes.word(n, "memory") == "last":
            return f"{n.type} with memory = last drifts, so that HystFMU.Actuators.Hysteresis has no class for it"
    return "HystFMU.Actuators.Hysteresis has no class for these blocks: " + ", ".join(n.type for n in graph.nodes)


ROWS, HELD = 400, 100  # rows of the ramp that gives the stroke, and rows with constant input at each end
SMALL = 1e-3  # amplitude of a small vibration, relative to the range of the input
FOREVER = 1e9


@dataclass(frozen=True)
class Made:
    """An actuator in SI units.

    `low` and `high` are the range of the voltage or current in the data. `unit` and `metre` are the factors that
    convert input and output of the data to SI units.
    """

    form: Form
    slot: Slot
    unit: float
    metre: float
    low: float
    high: float
    mechanics: Mechanics

    @property
    def start(self) -> float:
        """Voltage or current at which the memory is at rest."""
        return (self.slot.rest - self.slot.shift) / self.slot.gain * self.unit


def refusal(model: Model) -> str:
    """Return the reason why a model cannot be exported as an actuator, as the end of a sentence; "" if it can."""
    graph = model.graph
    if not temperatures(graph) or len(graph.outputs) != 1:
        return "the model must have one input and one output, and no covariate but one temperature in K or degC"
    units = graph.inputs[0].unit, graph.outputs[0].unit
    if si(units[0])[0] not in FORMS or si(units[1])[0] != "m":
        got = " to ".join(u or "none" for u in units) if any(units) else "no units of measure"
        wanted = (
            "map a voltage or a current to a length by the units of measure of its data, such as columns 'u [V]' and "
            "'y [um]'"
        )
        return f"the model must {wanted}. Got {got} instead"
    found = fold(graph, model.step or 1.0)
    if found is not None and found.least_slope <= 0:
        return (
            "the output of its operator must rise with the input on every branch. Got a slope of "
            f"{found.least_slope:.3g} after a reversal, against {found.first_slope:.3g} on the first branch"
        )
    if found is None:
        return why_not(graph)
    if not (stroke := _stroke(model)) > 0:
        return f"the output must rise with the input over its range. Got a change of {stroke:.3g} {units[1]}"
    return ""


def made(model: Model, sheet: Sheet) -> Made:
    """Convert a model to an actuator with the data-sheet values `sheet`. For this model, `refusal` must return ""."""
    found = fold(model.graph, model.step or 1.0)
    assert found is not None
    (name, unit), metre = si(model.graph.inputs[0].unit), si(model.graph.outputs[0].unit)[1]
    low, high = span(model) or (-1.0, 1.0)
    rest = (found.rest - found.shift) / found.gain
    swing = rest + SMALL * (high - low) * np.array([0.0, 1.0, -1.0, 1.0, -1.0])
    y = _held(_static(model.graph)).run(_beside(model, swing), model.step or 1.0)
    slope = float(y[-2] - y[-1]) * metre / (2 * SMALL * (high - low) * unit)
    mode = Mode.of(model.fit if _dynamics(model.graph) else {})
    parts = mechanics(FORMS[name], sheet, (high - low) * unit, _stroke(model) * metre, max(slope, 0.0), mode)
    return Made(FORMS[name], found, unit, metre, low * unit, high * unit, parts)


def _stroke(model: Model) -> float:
    """Return the change of the output over the range of the input, in the unit of measure of the model."""
    low, high = span(model) or (-1.0, 1.0)
    ramp = np.concatenate([np.full(HELD, low), np.linspace(low, high, ROWS), np.full(HELD, high)])
    y = _static(model.graph).run(_beside(model, ramp), model.step or 1.0)
    return float(y[-1] - y[HELD - 1])


def _beside(model: Model, u: Array) -> Array:
    """Return the inputs of a model, one column each. The first column is `u`; a temperature keeps its start value."""
    return np.column_stack([u, *(np.full(len(u), p.start) for p in model.graph.inputs[1:])])


def _held(graph: Graph) -> Graph:
    """Return the graph with frozen creep, because creep does not follow a fast vibration."""
    for n in graph.nodes:
        if n.type == "creep":
            graph = graph.replace(n.with_values(T=n.value("T") * FOREVER))
    return graph


def _dynamics(graph: Graph) -> list[Node]:
    return [n for n in graph.nodes if n.type in LINEAR]


def _static(graph: Graph) -> Graph:
    """Return the graph with static gains instead of linear dynamics and delay.

    The mechanics of the actuator replace these dynamics.
    """
    for n in _dynamics(graph):
        gain = static_gain(n) if n.block.parameter("hold") else 1.0
        graph = graph.replace(Node(n.name, "scaling", {"n": 1}, {"gain": gain}))
    return graph


ACTUATOR = ("Actuator", "ActuatorExample")  # classes in a package


def actuator_files(model: Model, within: str, told: str, values: Mapping[str, float] | None) -> dict[str, str]:
    """Return the texts of the Modelica files of the actuator, by class name.

    The result is empty if the model cannot be exported as an actuator and no data sheet is given.

    Parameters
    ----------
    model : Model
    within : str
        Name of the package.
    told : str
        Fit quality and provenance as HTML.
    values : mapping of (str, float) or None
        Data sheet; None if no data sheet is known.

    Raises
    ------
    InputError
        A data sheet is given, but the model cannot be exported as an actuator, or a value of the data sheet is invalid.
    """
    why = refusal(model)
    if why and values is not None:
        raise InputError(f"a data sheet needs an actuator, but {why}")
    if why:
        return {}
    a, (part, shown) = made(model, Sheet.of(values or {})), ACTUATOR
    return {part: actuator(model, a, part, within, told), shown: actuator_example(a, shown, within, part)}


def actuator_told(model: Model, values: Mapping[str, float] | None) -> list[str]:
    """Return the sources of mass, stiffness and capacitance of the actuator, one line each.

    If the model cannot be exported as an actuator, the only line states the reason. `values` is the data sheet.
    """
    if why := refusal(model):
        return [f"no actuator: {why}"]
    return list(made(model, Sheet.of(values or {})).mechanics.told)


def actuator(model: Model, a: Made, name: str, within: str, history: str = "") -> str:
    """Return the text of the Modelica file of the actuator, without its first line (the mark of an exported file).

    Parameters
    ----------
    model : Model
        Identified model.
    a : Made
        Actuator of the model.
    name, within : str
        Name of the class and of its package.
    history : str
        Fit quality and provenance as HTML.
    """
    s, p, form = a.slot, a.mechanics, a.form
    scaling = {
        "gain": s.gain / a.unit,
        "shift": s.shift,
        "scale": s.scale * a.metre,
        "offset": s.offset * a.metre,
    }
    own = [f"{k} = {v}" for k, v in s.values.items()] + [f"{k} = {number(v)}" for k, v in scaling.items()]
    values = {form.limit: number(p.most), form.symbol: number(p.C)}
    values |= {k: number(getattr(p, k)) for k in ("stroke", "k", "c", "share", "resistance", "tau")}
    values |= {"withMass": "false"} if p.m is None else {"m": number(p.m)}
    values[form.start] = number(a.start)
    given = [f"{k} = {v}" for k, v in values.items()]
    own.insert(0, f"u_start = {values[form.start]}")
    given.append(f"redeclare HystFMU.Actuators.Hysteresis.{s.name} hysteresis({', '.join(own)})")
    lines = [f"  extends HystFMU.Actuators.BaseClasses.{form.base}(", "    " + ",\n    ".join(given) + ");"]
    text = f"{form.text} with the identified hysteresis, in SI units"
    return class_text(f"model {name}", text, lines, string(_documentation(model, a, within, history)), within)


def _documentation(model: Model, a: Made, within: str, history: str) -> str:
    p, form = a.mechanics, a.form
    limits = [f"identified from {a.low:g} to {a.high:g} {form.unit}"]
    limits += [f"{text} is left out" for text in a.slot.left_out]
    if len(model.graph.inputs) > 1:
        limits.append(f"follows {form.warmed}, within the range of its training")
    limits += p.told
    if p.f_n is not None and p.lowest is not None:
        limits.append(
            f"the resonance is {p.f_n:.4g} Hz for small vibrations about {a.start:.4g} {form.unit}, and falls "
            f"towards {p.lowest:.4g} Hz over the whole range, where the material follows the force"
        )
    base = f"HystFMU.Actuators.BaseClasses.{form.base}"
    return (
        f"<html><p><b>Equation:</b> that of {base}; in its slot "
        f"HystFMU.Actuators.Hysteresis.{a.slot.name}.</p>{history}"
        f"<p><b>Source:</b> a model of kind {escape(model.key)}; the limitations state all other sources.</p>"
        f"<p><b>Limitations:</b> {'; '.join(limits)}.</p>"
        f"<p><b>Example:</b> {link(f'{within}.ActuatorExample', 'ActuatorExample')}.</p>"
        f"<p><b>See also:</b> {link(base)}.</p></html>"
    )


RESONANCE = 3000.0  # Hz, approximate resonance of the load on an actuator without a mass
BANDWIDTH, MARGIN = 1e4, 4.0  # bandwidth (rad/s) of a current drive; ratio of its largest to its needed voltage
FREQUENCY = 50.0  # Hz of the command, at most a tenth of the resonance


def actuator_example(a: Made, name: str, within: str, of: str) -> str:
    """Return the text of the Modelica file of an example of the actuator.

    A drive moves the actuator with a mass and a spring over the range of the data.

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
        "  extends HystFMU.Icons.Example;",
        f"  HystFMU.Sources.DecayingSine command({signal}) annotation ({placed(-90, 0)});",
        f"  HystFMU.Actuators.{drive} annotation ({placed(-50, 0)});",
        f"  {of} actuator annotation ({placed(20, 0)});",
        f"  HystFMU.Plants.Ground ground annotation ({placed(-10, -60)});",
        f"  HystFMU.Plants.Fixed fixed annotation ({placed(-50, -80)});",
        f"  HystFMU.Plants.SpringMassLoad load({load}) annotation ({placed(70, 0)});",
        "equation",
        *(_joined(*row) for row in _JOINED),
    ]
    told = f"A drive, the actuator, and a mass on a spring. {moved}"
    info = information(told, f"<b>See also:</b> {link(f'{within}.{of}', of)}.")
    text, before = "The actuator moves a mass on a spring", f"experiment({period}, Tolerance = 1e-9), "
    return class_text(f"model {name}", text, lines, info, within, before)


def _drive(a: Made, frequency: float) -> str:
    """Return the declaration of the drive: class, component name and parameters.

    A voltage drive has the voltage range of the data. A current drive has enough bandwidth and voltage for the current
    range of the data.
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
