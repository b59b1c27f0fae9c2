"""Port data of a fitted model: the range of the training rows, sizes, and the description of the output."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.graph import Port
from hystfmu.model import Model
from hystfmu.model.trained_range import COVARIATES, KEY


@dataclass(frozen=True)
class Facts:
    """Data of one port; None and "" if unknown.

    Parameters
    ----------
    low, high : float or None
        Least and largest value of the training rows, the start value included.
    nominal : float or None
        Size of its values.
    text : str
        Description.
    """

    low: float | None = None
    high: float | None = None
    nominal: float | None = None
    text: str = ""


def _size(x: float) -> float | None:
    """Return a size with two digits; None if it cannot be a nominal value."""
    return float(f"{x:.2g}") if math.isfinite(x) and x > 0 else None


def _of_input(port: Port, span: object) -> Facts:
    if not (isinstance(span, list | tuple) and len(span) == 2 and all(math.isfinite(x) for x in span)):
        return Facts()
    low, high = min(span[0], *port.start), max(span[1], *port.start)
    return Facts(max(low, port.var.lo), min(high, port.var.hi), _size(max(abs(span[0]), abs(span[1]))))


def facts_of(model: Model, y: Array) -> Mapping[str, Facts]:
    """Return the data of a model on its real ports, by name.

    Inputs have the range of the training rows. Outputs have the size that the reference run reaches. They have no
    range, because a model may leave the range of the training rows.

    Parameters
    ----------
    model : Model
    y : array, shape (n, n_outputs)
        Outputs of its reference run.
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
