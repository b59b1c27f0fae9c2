"""Information of a new input about the parameters of a model, in addition to the record of the fit.

J contains the derivatives of the output with respect to relative changes of each parameter, on the record and on the
new input. sigma is the error of the fit. The information is log det(I + J'J / sigma^2). Thus each direction of the
parameters contributes the factor by which its uncertainty decreases from 100 % (D-optimal design; Pukelsheim, Optimal
Design of Experiments, 1993). A direction that the record determines contributes little. For a model with many
parameters, the information is the share of its states on the new input that have no near state in the record.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.identify.estimate.runs import Runs
from hystfmu.identify.excitation.not_shown import new_states
from hystfmu.model import Model

MOST = 80  # elements of parameters whose derivatives are taken
MOST_ROWS = 2000  # of each run that count: more are thinned evenly
LEAST_NOISE = 1e-4  # of the span: a fit without noise


def information(model: Model, data: Dataset, u: Array, h: float) -> float:
    """Return the information of an input u (m,) with the step h (s), in addition to the data of the fit."""
    values = {
        f"{model.graph.nodes[p.node].name}.{p.var.name}": np.asarray(p.start, dtype=np.float64)
        for p in model.graph.ports
        if p.is_parameter and p.var.type == "real"
    }
    changes = [
        {name: np.where(np.arange(len(v)) == k, v, 0.0)}
        for name, v in values.items()
        for k in np.flatnonzero((v != 0) & (np.abs(v) < 1e300))
    ]
    if not 0 < len(changes) <= MOST or len(model.graph.inputs) > 1:
        return new_states(data, u)
    runs, sigma = Runs(model.graph), max(float(model.fit.get("rms", 0.0)), LEAST_NOISE * data.span)

    def scaled(v: Array, step: float) -> Array:
        """Return derivatives over sigma of some rows of a run, weighted for all rows, shape (rows, changes)."""
        rows = np.arange(len(v))[:: -(-len(v) // MOST_ROWS)]
        j = runs.sensitivities(v.reshape(-1, 1), step, changes, rows)[1]
        return np.asarray(j * (np.sqrt(len(v) / len(rows)) / sigma))

    known = np.vstack([np.eye(len(changes)), *(scaled(data.u[rows], data.h) for rows in data.records)])
    gain = _log_det(np.vstack([known, scaled(u, h)])) - _log_det(known)
    return float(gain) if np.isfinite(gain) else new_states(data, u)


def _log_det(a: Array) -> float:
    """Return log det a'a, by QR; infinite or NaN where a is not finite."""
    if not np.isfinite(a).all():
        return float("nan")
    return float(2 * np.log(np.abs(np.diag(np.linalg.qr(a, mode="r")))).sum())
