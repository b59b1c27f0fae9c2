"""An identified model folded into the slot of an actuator, with its mechanics, in SI units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hystfmu.model import Model
from hystfmu.modelica.actuator.sheet import Mechanics, Sheet, mechanics
from hystfmu.modelica.actuator.slot import Slot, slot
from hystfmu.modelica.measures import si
from hystfmu.modelica.span import span

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
    """Reason why a model has no actuator, as the end of a sentence, or ""."""
    graph = model.graph
    if len(graph.inputs) != 1 or len(graph.outputs) != 1:
        return "the model must have one input and one output"
    units = graph.inputs[0].unit, graph.outputs[0].unit
    if tuple(si(u)[0] for u in units) != ("V", "m"):
        got = " to ".join(u or "none" for u in units) if any(units) else "no units of measure"
        wanted = "map a voltage to a length by the units of measure of its data, such as columns 'u [V]' and 'y [um]'"
        return f"the model must {wanted}. Got {got} instead"
    found = slot(graph)
    if found is not None and found.least_slope <= 0:
        return (
            "the output of its operator must rise with the input on every branch. Got a slope of "
            f"{found.least_slope:.3g} after a reversal, against {found.first_slope:.3g} on the first branch"
        )
    if found is None:
        return f"HystFMU.Actuators.Hysteresis has no class for a model of kind {model.key!r} with these blocks"
    return ""


def made(model: Model, sheet: Sheet) -> Made:
    """Fold a model that `refusal` does not refuse."""
    found = slot(model.graph)
    assert found is not None
    volt, metre = si(model.graph.inputs[0].unit)[1], si(model.graph.outputs[0].unit)[1]
    low, high = span(model) or (-1.0, 1.0)
    ramp = np.concatenate([np.full(HELD, low), np.linspace(low, high, ROWS), np.full(HELD, high)])
    y = model.predict(ramp)
    stroke = abs(float(y[-1] - y[HELD - 1])) * metre
    f_n, zeta = (model.fit.get(k) for k in ("f_n", "zeta"))
    dynamics = any(n.type == "transfer_function" for n in model.graph.nodes)
    known = (f_n, zeta) if dynamics else (None, None)
    return Made(found, volt, metre, low * volt, high * volt, mechanics(sheet, (high - low) * volt, stroke, *known))
