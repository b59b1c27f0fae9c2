"""Conversion of an identified model to an actuator: class of the hysteresis, mechanical parameters, SI units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.graph import Graph, Node
from hystfmu.model import Model
from hystfmu.modelica import classes
from hystfmu.modelica.actuator.chain import bouc_wen, chain, preisach, temperatures, warm
from hystfmu.modelica.actuator.mechanics import FORMS, Form, Mechanics, Mode, Sheet, mechanics
from hystfmu.modelica.actuator.operators import magnetic, network, operator
from hystfmu.modelica.actuator.slot import Slot
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
        if any(v.name == "memory" for v in n.block.parameters) and classes.word(n, "memory") == "last":
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
    return ""


def made(model: Model, sheet: Sheet) -> Made:
    """Convert a model to an actuator with the data-sheet values `sheet`. For this model, `refusal` must return ""."""
    found = fold(model.graph, model.step or 1.0)
    assert found is not None
    (name, unit), metre = si(model.graph.inputs[0].unit), si(model.graph.outputs[0].unit)[1]
    low, high = span(model) or (-1.0, 1.0)
    ramp = np.concatenate([np.full(HELD, low), np.linspace(low, high, ROWS), np.full(HELD, high)])
    static, h = _static(model.graph), model.step or 1.0
    y = static.run(_beside(model, ramp), h)
    stroke = abs(float(y[-1] - y[HELD - 1])) * metre
    rest = (found.rest - found.shift) / found.gain
    swing = rest + SMALL * (high - low) * np.array([0.0, 1.0, -1.0, 1.0, -1.0])
    y = _held(static).run(_beside(model, swing), h)
    slope = float(y[-2] - y[-1]) * metre / (2 * SMALL * (high - low) * unit)
    mode = Mode.of(model.fit if _dynamics(model.graph) else {})
    parts = mechanics(FORMS[name], sheet, (high - low) * unit, stroke, max(slope, 0.0), mode)
    return Made(FORMS[name], found, unit, metre, low * unit, high * unit, parts)


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
    return [n for n in graph.nodes if n.type in ("transfer_function", "delay")]


def _static(graph: Graph) -> Graph:
    """Return the graph with static gains instead of linear dynamics and delay.

    The mechanics of the actuator replace these dynamics.
    """
    for n in _dynamics(graph):
        gain = float(n.value("b")[-1] / n.value("a")[-1]) if n.type == "transfer_function" else 1.0
        graph = graph.replace(Node(n.name, "scaling", {"n": 1}, {"gain": gain}))
    return graph
