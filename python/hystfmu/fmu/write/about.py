"""Facts of an FMU from the fitted model in it: name, description, and the ranges and sizes of its ports.

All facts come from the model and from the record of its fit, so that equal models give equal bytes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.graph import Port
from hystfmu.model import Model
from hystfmu.model.coverage import COVARIATES, KEY

_DIGITS = 8  # of a hash, for a reader
_MOST = 60  # characters of the name of a record: that of many joined ones has no end


def record_of(model: Model) -> Mapping[str, Any]:
    """Return the provenance of the record that a model, or the model that it inverts, was fitted to."""
    told: Any = model.provenance
    while isinstance(told, Mapping) and isinstance(told.get("of"), Mapping):
        told = told["of"]
    return told if isinstance(told, Mapping) and isinstance(told.get("data"), str) and told["data"] else {}


def name_of(model: Model) -> str:
    """Return the name of an FMU, made of record and kind."""
    record = record_of(model)
    return f"{_short(record['data'])} {model.key}" if record else model.key


def description_of(model: Model) -> str:
    """Return one line: kind, record, range and units of measure of the record, and error on the record."""
    record = record_of(model)
    if not record:
        return model.text
    inverse = "inverse" in model.provenance
    unit_u, unit_y = (ports[0].unit if ports else "" for ports in (model.graph.inputs, model.graph.outputs))
    if inverse:
        unit_u, unit_y = unit_y, unit_u
    known = [
        _range(record.get("trained_u", record.get("span_u")), unit_u),
        f"output in {unit_y}" if unit_y else "",
        "" if inverse else _error(model.fit.get("rms_percent")),
        f"SHA-256 {record['sha256'][:_DIGITS]}" if isinstance(record.get("sha256"), str) else "",
    ]
    listed = ", ".join(filter(None, known))
    of = "inverse of a model that was " if inverse else ""
    origin = f"{of}fitted to the record {_short(record['data'])}"
    return "; ".join(filter(None, [model.text, f"{origin}: {listed}" if listed else origin]))


def _short(text: str) -> str:
    return text if len(text) <= _MOST else f"{text[:_MOST]}..."


def _range(span: Any, unit: str) -> str:
    if not (isinstance(span, list | tuple) and len(span) == 2 and all(isinstance(x, int | float) for x in span)):
        return f"input in {unit}" if unit else ""
    return f"input {span[0]:.6g} to {span[1]:.6g} {unit}".rstrip()


def _error(percent: Any) -> str:
    known = isinstance(percent, int | float) and math.isfinite(percent)
    return f"RMS error {percent:.2g} % of the span of the output" if known else ""


@dataclass(frozen=True)
class Facts:
    """Data of one port; unknown data are None or "".

    Parameters
    ----------
    low, high : float or None
        Least and largest value of the training rows, including the start value.
    nominal : float or None
        Typical size of the values.
    text : str
        Description.
    """

    low: float | None = None
    high: float | None = None
    nominal: float | None = None
    text: str = ""


def _size(x: float) -> float | None:
    """Return a size with two digits; None if the size cannot be a nominal value."""
    return float(f"{x:.2g}") if math.isfinite(x) and x > 0 else None


def _of_input(port: Port, span: object) -> Facts:
    if not (isinstance(span, list | tuple) and len(span) == 2 and all(math.isfinite(x) for x in span)):
        return Facts()
    low, high = min(span[0], *port.start), max(span[1], *port.start)
    return Facts(max(low, port.var.lo), min(high, port.var.hi), _size(max(abs(span[0]), abs(span[1]))))


def facts_of(model: Model, y: Array) -> Mapping[str, Facts]:
    """Return the data of a model on its real ports, by name.

    Inputs have the range of the training rows. Outputs have the largest size in the reference run. Outputs have no
    range, because a model may leave the range of the training rows.

    Parameters
    ----------
    model : Model
    y : array, shape (n, n_outputs)
        Outputs of the reference run of the model.
    """
    found: dict[str, Facts] = {}
    spans = {**model.provenance.get(COVARIATES, {})}
    if model.graph.inputs and KEY in model.provenance:
        spans[model.graph.inputs[0].name] = model.provenance[KEY]
    at = 0
    for p in model.graph.ports:
        if p.kind == "input" and p.var.type == "real":
            found[p.name] = _of_input(p, spans.get(p.name))
        elif p.kind == "output":
            columns = y[:, at : at + p.size]
            at += p.size
            if p.var.type == "real":
                sizes = np.abs(columns[np.isfinite(columns)])
                own = next((o.text for o in model.graph.outputs if o.name == p.name), "")
                what = f"output of the model {model.key}" + (f", in {p.unit}" if p.unit else "")
                found[p.name] = Facts(nominal=_size(float(sizes.max(initial=0.0))), text="" if own else what)
    return found
