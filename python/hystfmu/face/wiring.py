"""Default wires of a scenario built in Python: unconnected units are wired by their roles.

inverse ``inverse.u`` as a source stands for the output of the inverse, whatever its name is. An inverse without a
source reads ``reference.r_lead``, the reference ahead by the delay of its step. controller if it has no connections, it
is inserted in front of the plant: the former source of the plant becomes its feed-forward u_ff, its u drives the plant,
and it compares ``reference.r`` with the signal
            of the metric. A controller with connected output keeps its wires and gets the missing ones, y_d and y; a
            feed-forward u_ff that is not connected is 0.

The saved scenario.toml states all of them.
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
    """The connections with those that follow from the roles of the units.

    Parameters
    ----------
    spec : mapping
        What was said.
    attached : mapping of str to Model or Path
        The models among its units, by their paths.
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
    """Return the units, with a feed-forward of 0 for connected controllers without one.

    Parameters
    ----------
    units : mapping
        Tables of the units.
    wires : mapping
        Connections, complete.
    """
    made = dict(units)
    for name, unit in units.items():
        drives = any(source == f"{name}.u" for source in wires.values())
        if _is_controller(unit) and drives and f"{name}.u_ff" not in wires:
            made[name] = {**unit, "inputs": {"u_ff": 0.0} | unit.get("inputs", {})}
    return made


def _inverse(unit: Mapping[str, Any], attached: Mapping[str, Model | Path]) -> Model | None:
    """The model of a unit that is an inverse with one input and one output."""
    model = attached.get(unit.get("model", ""))
    if not isinstance(model, Model) or "inverse" not in model.provenance:
        return None
    return model if len(model.graph.inputs) == len(model.graph.outputs) == 1 else None


def _measured(spec: Mapping[str, Any]) -> str | None:
    """The signal that a metric compares with the reference."""
    for m in spec.get("metrics", {}).values():
        if (m.get("against") or "").startswith("reference."):
            return str(m["signal"])
    return None


def _is_controller(unit: Mapping[str, Any]) -> bool:
    block = block_types().get(unit.get("block", ""))
    return block is not None and block.family == "controllers" and {v.name for v in block.of("input")} == CONTROLLER


def _loop_ports(unit: Mapping[str, Any]) -> set[str]:
    """The inputs of a controller that compares a reference with a measurement; else none."""
    block = block_types().get(unit.get("block", ""))
    ports = {v.name for v in block.of("input")} if block is not None and block.family == "controllers" else set()
    return ports if {"y_d", "y"} <= ports else set()


def _touched(name: str, wires: Wires) -> bool:
    return any(end.startswith(f"{name}.") for pair in wires.items() for end in pair)
