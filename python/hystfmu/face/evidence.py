"""Evidence of linear dynamics in the record of a fit. The model stores it as ``fit["evidence"]``."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.face.model import Model
from hystfmu.graph import Graph
from hystfmu.model import run_along

if TYPE_CHECKING:
    from hystfmu.identify.evidence import Evidence

__all__ = ["evidence_of", "with_evidence"]


def evidence_of(model: Model, data: Dataset) -> Evidence:
    """Find the evidence of linear dynamics in a record.

    Parameters
    ----------
    model : Model
        Model that was fitted to `data`. The output of its hysteresis is the input of the dynamics. If the model is not
        a static part in front of linear dynamics, u is the input of the dynamics.
    data : Dataset
        Record with a measured output.
    """
    from hystfmu.identify.evidence import evidence

    return evidence(data, static_output(model, data))


def static_output(model: Model, data: Dataset) -> Array | None:
    """Return the output (n,) of the static part of a model; None if no static part precedes linear dynamics."""
    from hystfmu.inverse.dynamic import split

    parts = split(model)
    graph: Graph = model.graph if parts is None else parts.front.graph
    if any(n.block.rate not in ("function", "hysteretic") and n.block.name != "creep" for n in graph.nodes):
        return None
    return run_along(graph, data)


def with_evidence(model: Model, data: Dataset) -> Model:
    """Return the model with the evidence of the record of its fit."""
    return replace(model, fit={**model.fit, "evidence": evidence_of(model, data).to_dict()})
