"""Default connections of a scenario built in Python. They follow from the roles of the units.

- Inverse: ``inverse.u`` as a source means the output of the inverse, even if this output has another name. An inverse
  without a source reads ``reference.r_lead``, which is ahead of the reference by the delay of a step.
- Controller without connections: it is inserted in front of the plant. The former source of the plant becomes the
  feed-forward u_ff of the controller, and the output u of the controller drives the plant. The controller compares
  ``reference.r`` with the signal of the metric.
- Controller with a connected output: it keeps its connections, and the missing inputs y_d and y are connected. An
  unconnected feed-forward u_ff is 0.

The saved scenario.toml states all connections.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hystfmu.core.library import block_types
from hystfmu.model import Model

Wires = dict[str, str]  # input -> output, as in a scenario.toml
CONTROLLER = {"y_d", "y", "u_ff"}


def wired(spec: Mapping[str, Any], attached: Mapping[str, Model | Path]) -> Wires:
    """Return the given connections and the default connections.

    Parameters
    ----------
    spec : mapping
        The given keys of the scenario.
    attached : mapping of str to Model or Path
        Models of units, by their paths in the scenario.
    """
    wires: Wires = dict(spec.get("connections", {}))
    units: Mapping[str, Any] = spec.get("units", {})
    inverses = {name: m for name, u in units.items() if (m := _inverse(u, attached)) is not None}
    for target, source in wires.items():
        name, _, port = source.partition(".")
        if name in inverses and port == "u" and port not in {o.name for o in inverses[name].graph.outputs}:
            wires[target] = f"{name}.{inverses[name].graph.outputs[0].name}"
    measured = _measured(spec)
    if measured is None:
        return wires
    for name in inverses:
        end = f"{name}.{inverses[name].graph.inputs[0].name}"
        used = any(source.startswith(f"{name}.") for source in wires.values())
        if used and end not in wires:
            wires[end] = "reference.r_lead"
    plant = f"{measured.split('.')[0]}.u"
    alone = [name for name, u in units.items() if _is_controller(u) and not _touched(name, wires)]
    if len(alone) == 1 and plant in wires:  # two without a wire: neither place is said
        (name,) = alone
        wires |= {f"{name}.u_ff": wires[plant], f"{name}.y_d": "reference.r", f"{name}.y": measured}
        wires[plant] = f"{name}.u"
    for name, unit in units.items():
        drives = any(source.startswith(f"{name}.") for source in wires.values())
        if drives and (ports := _loop_ports(unit)):
            fixed = unit.get("inputs", {})
            for port, source in (("y_d", "reference.r"), ("y", measured)):
                if port in ports and port not in fixed:
                    wires.setdefault(f"{name}.{port}", source)
    return wires


def at_rest(units: Mapping[str, Any], wires: Mapping[str, str]) -> dict[str, Any]:
    """Return the units; a connected controller without feed-forward gets the constant feed-forward 0.

    Parameters
    ----------
    units : mapping
        Tables of the units.
    wires : mapping
        All connections.
    """
    made = dict(units)
    for name, unit in units.items():
        drives = any(source == f"{name}.u" for source in wires.values())
        if _is_controller(unit) and drives and f"{name}.u_ff" not in wires:
            made[name] = {**unit, "inputs": {"u_ff": 0.0} | unit.get("inputs", {})}
    return made


def _inverse(unit: Mapping[str, Any], attached: Mapping[str, Model | Path]) -> Model | None:
    """Return the model of a unit if it is an inverse with one input and one output, else None."""
    model = attached.get(unit.get("model", ""))
    if not isinstance(model, Model) or "inverse" not in model.provenance:
        return None
    return model if len(model.graph.inputs) == len(model.graph.outputs) == 1 else None


def _measured(spec: Mapping[str, Any]) -> str | None:
    """Return the signal that a metric compares with the reference."""
    for m in spec.get("metrics", {}).values():
        if (m.get("against") or "").startswith("reference."):
            return str(m["signal"])
    return None


def _is_controller(unit: Mapping[str, Any]) -> bool:
    block = block_types().get(unit.get("block", ""))
    return block is not None and block.family == "controllers" and {v.name for v in block.of("input")} == CONTROLLER


def _loop_ports(unit: Mapping[str, Any]) -> set[str]:
    """Return the inputs of a controller that compares reference and measurement; otherwise an empty set."""
    block = block_types().get(unit.get("block", ""))
    ports = {v.name for v in block.of("input")} if block is not None and block.family == "controllers" else set()
    return ports if {"y_d", "y"} <= ports else set()


def _touched(name: str, wires: Wires) -> bool:
    return any(end.startswith(f"{name}.") for pair in wires.items() for end in pair)
