"""Defaults of a scenario built in Python: its order, a reference over the plant's stroke, the end of the run.

wires those that follow from the roles of the units: see `hystfmu.face.wiring`. reference connections or metrics name
the unit ``reference``, but none was added: a sine over SHARE of the stroke of the plant (the unit that a metric
compares with it); SAMPLES steps a period; `r_lead` looks one step ahead
           (half a step where the run looks between samples).
stop       PERIODS of the slowest reference; metrics without an `after` of their own begin after the first.
order      that in which the units were added, the default reference first.
record     the signals of the metrics.
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
    """The whole scenario, with the keys of its file.

    Parameters
    ----------
    spec : mapping
        What was said.
    attached : mapping of str to Model or Path
        The models among its units, by their paths.
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
    """The unit `reference`."""
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
    """Of the slowest reference (s)."""
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
    """A time as a whole number of steps, up to rounding."""
    return float(f"{math.ceil(seconds / step * (1 - 1e-9)) * step:.12g}")
