"""Origin of an FMU: name and description that distinguish it from the FMU of another device.

Both come from the model and the record that it was fitted to, so that equal models give equal bytes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from hystfmu.model import Model

_DIGITS = 8  # of a hash, for a reader
_MOST = 60  # characters of the name of a record: that of many joined ones has no end


def record_of(model: Model) -> Mapping[str, Any]:
    """Return the provenance of the record that a model, or the model that it inverts, was fitted to."""
    told: Any = model.provenance
    while isinstance(told, Mapping) and isinstance(told.get("of"), Mapping):
        told = told["of"]
    return told if isinstance(told, Mapping) and isinstance(told.get("data"), str) and told["data"] else {}


def name_of(model: Model) -> str:
    """Return the name of an FMU: record and kind."""
    record = record_of(model)
    return f"{_short(record['data'])} {model.key}" if record else model.key


def description_of(model: Model) -> str:
    """Return one line: the kind, the record, its range and units of measure, and the error on it."""
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
