"""Defaults of a scenario built in Python: order, reference and end of the run.

A key that is not given gets this default:

- ``connections``: the connections that follow from the roles of the units (`hystfmu.face.wiring`).
- ``reference``: if connections or metrics name this unit, but it was not added, it is made. It is a sine over SHARE of
  the stroke of the plant, with SAMPLES steps per period. The plant is the unit that a metric compares with the
  reference. The output `r_lead` is one step ahead, or half a step if the run has steps between samples.
- ``stop``: PERIODS periods of the slowest reference. A metric without its own `after` starts after the first period.
- ``order``: the order in which the units were added; the default reference is first.
- ``record``: the signals of the metrics.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.face.wiring import at_rest, wired
from hystfmu.model import Model

NAME = "reference"
SHARE, SAMPLES, PERIODS = 0.8, 1000, 3
ROWS = 1000  # of the ramp that finds the stroke of a plant


def completed(spec: Mapping[str, Any], attached: Mapping[str, Model | Path], origin: str) -> dict[str, Any]:
    """Return the complete scenario, with the keys of its file.

    Parameters
    ----------
    spec : mapping
        The given keys of the scenario.
    attached : mapping of str to Model or Path
        Models of units, by their paths in the scenario.
    origin : str
        Prefix of error messages.

    Raises
    ------
    InputError
        There is no unit or metric, no reference can be made, or the end of the run is not defined.
    """
    units: dict[str, Any] = dict(spec.get("units", {}))
    metrics: dict[str, Any] = {k: dict(m) for k, m in spec.get("metrics", {}).items()}
    if not units:
        raise InputError(f"{origin}: A scenario must have a unit. Got none; add(name, model) adds one.")
    if not metrics:
        raise InputError(f"{origin}: A scenario must have a metric. Got none; metric(name, kind, signal) adds one.")
    order = list(spec.get("order", units))
    if wires := wired(spec, attached):
        spec = {**spec, "connections": wires}
        units = at_rest(units, wires)
    if NAME not in units and _asks_for_reference(spec):
        units = {NAME: _reference(spec, attached, origin), **units}
        order = [NAME, *order]
    whole = {**spec, "order": order, "units": units, "metrics": metrics}
    if "stop" not in spec:
        period = _period(units, origin)
        whole["stop"] = _steps(PERIODS * period, spec["step"])
        for m in metrics.values():
            m.setdefault("after", _steps(period, spec["step"]))
    if "record" not in spec:
        named = [m[key] for m in metrics.values() for key in ("against", "signal") if m.get(key)]
        whole["record"] = list(dict.fromkeys(named))
    return whole


def _asks_for_reference(spec: Mapping[str, Any]) -> bool:
    named = [*spec.get("connections", {}).values()]
    named += [m.get(key) or "" for m in spec.get("metrics", {}).values() for key in ("signal", "against")]
    return any(end.startswith(f"{NAME}.") for end in named)


def _reference(spec: Mapping[str, Any], attached: Mapping[str, Model | Path], origin: str) -> dict[str, Any]:
    """Return the table of the unit `reference`."""
    plant = next(
        (m["signal"].split(".")[0] for m in spec["metrics"].values() if (m.get("against") or "").startswith(NAME)),
        "plant",
    )
    unit = spec["units"].get(plant, {})
    model = attached.get(unit.get("model", ""))
    span = model.provenance.get("span_u") if isinstance(model, Model) else None
    if not isinstance(model, Model) or span is None:
        raise InputError(
            f"{origin}: units: The stroke of {plant!r} must be known to make a unit {NAME!r}. Got no identified model; "
            f"add({NAME!r}, hystfmu.blocks.Reference(amplitude=..., frequency=...))."
        )
    lo, hi = span
    start = float(model.graph.inputs[0].start)
    path = [np.linspace(a, b, ROWS) for a, b in ((start, lo), (lo, hi), (hi, lo))]
    y = model.predict(np.concatenate(path))[ROWS:]
    low, high = float(y.min()), float(y.max())
    fine = any(u.get("fine") for u in spec["units"].values())
    between = fine and spec.get("ripple", 1) > 1
    values = {
        "shape": "sine",
        "amplitude": SHARE * (high - low) / 2,
        "offset": (high + low) / 2,
        "frequency": float(f"{1 / (SAMPLES * spec['step']):.6g}"),
        "lead": spec["step"] / 2 if between else spec["step"],
    }
    text = f"{100 * SHARE:g} % of the stroke of {plant}"
    return {"block": "reference", "values": values, "text": text, **({"fine": True} if fine else {})}


def _period(units: Mapping[str, Any], origin: str) -> float:
    """Return the period of the slowest reference (s)."""
    rates = []
    for u in units.values():
        if u.get("block") == "reference":
            values = {**u.get("values", {}), **u.get("set", {})}
            f = values.get("frequency", 1.0)
            if values.get("shape", "sine") in ("sine", "triangle", "decaying_sine") and f > 0:
                rates.append(f)
    if not rates:
        raise InputError(
            f"{origin}: stop: The end of the run must be given, or follow from a periodic reference. Got neither; "
            "Scenario(..., stop=...) states it."
        )
    return float(1 / min(rates))


def _steps(seconds: float, step: float) -> float:
    """Round a time up to a whole number of steps."""
    return float(f"{math.ceil(seconds / step * (1 - 1e-9)) * step:.12g}")
