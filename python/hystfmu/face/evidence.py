"""Evidence of linear dynamics in the record of a fit. The model stores it as ``fit["evidence"]``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hystfmu.data import Dataset
from hystfmu.face.model import Model
from hystfmu.model import run_along

if TYPE_CHECKING:
    from hystfmu.identify.evidence import Evidence

__all__ = ["evidence_of"]


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
    from hystfmu.inverse.dynamic import split

    parts = split(model)
    graph = model.graph if parts is None else parts.front.graph
    # lags of creep pass the input at once, so that they count as static
    static = all(n.block.rate in ("function", "hysteretic") or n.block.name == "creep" for n in graph.nodes)
    return evidence(data, run_along(graph, data) if static else None)
