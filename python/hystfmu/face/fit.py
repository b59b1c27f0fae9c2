"""The function `hystfmu.fit`: identification, errors on held-out rows, and evidence of linear dynamics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from hystfmu.base import InputError, checked
from hystfmu.data import Dataset
from hystfmu.face.model import Model
from hystfmu.model import run_along

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hystfmu.data.reader.arrays import Columns
    from hystfmu.graph import Graph
    from hystfmu.graph.blocks import Block
    from hystfmu.identify.estimate.free import Spec
    from hystfmu.identify.evidence import Evidence
    from hystfmu.identify.kinds import Kind


@checked
def fit(
    data: Dataset | Columns,
    key: Kind | Path | Graph | Block = "auto",
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    purpose: Literal["model", "inverse"] = "model",
    free: Mapping[str, Spec] | None = None,
    **options: Any,
) -> Model:
    """Identify a model from measured data.

    Parameters
    ----------
    data : Dataset or data frame
        Measured data. The simulation of the model starts at row 0. The fit minimises the error on the rows
        `data.train`.
    key : str, Graph, block of `hystfmu.blocks` or Path
        Kind of model. "auto" compares several kinds on the data and selects the best one.

        ``hystfmu fit --models`` lists all kinds of model. Instead of a kind, `key` may be a graph of blocks with free
        parameters, or the path of a file with both, as for ``hystfmu fit --graph``. If `key` is a single block, the
        input is scaled to [-1, 1], and the output of the model is a weighted sum of the outputs of the block.
        ``"auto"`` tests the data for return-point memory and rate dependence, and discards the kinds of model that
        cannot represent these properties. Of the other kinds, it selects the kind with the smallest error on validation
        blocks. These are parts of the training rows between reversals.
    seed : int
        Seed of the random start values. The same seed gives the same model.
    progress : function, optional
        Called with the completed fraction, 0 to 1.
    purpose : {"model", "inverse"}
        Purpose of the model. With "inverse", the model must have a useful exact or implicit inverse, and ``"auto"``
        compares only kinds of model that have such an inverse.
    free : dict, optional
        Free parameters of a graph. Each key is ``"node.parameter"`` or ``"node.parameter[1]"``. Each value is True, the
        bounds ``(lower, upper)``, or a dict. The keys of this dict are ``lower``, ``upper``, ``scale`` ("log" or
        "linear"), ``rising`` (True: the elements do not decrease) and ``sum`` (the elements are positive with this
        sum); all keys are optional. The fit detects parameters that enter the output linearly, and computes them by
        linear least squares. Such parameters are non-negative if their lower bound is 0. For a single block, all real
        parameters without a given value are free by default.
    **options
        Options of the kind of model. For a graph of blocks, the options are ``starts`` (number of start points of the
        search) and ``seconds`` (time limit of the search).

    Returns
    -------
    Model
        `fit` of the model contains the errors on the training rows (``rms_percent`` and ``max_percent``, in %FS), the
        number of ``parameters`` and ``warnings``. If rows follow the training rows, ``held_out_rms_percent`` and
        ``held_out_max_percent`` are the errors on these rows. ``fit["evidence"]`` contains the evidence of linear
        dynamics in the record (`hystfmu.identify.evidence`). After the fit of a graph, ``fit["free"]`` contains each
        free parameter with its standard error.

    Raises
    ------
    InputError
        The kind or an option is unknown, or a value is out of range. The data contain no output, or the signals are
        constant. ``"auto"`` finds no kind of model that can represent the data or that has a useful inverse. A
        parameter in `free` does not exist in the graph, or its value in the graph is outside its bounds.

    Examples
    --------
    >>> import hystfmu as hy
    >>> data = hy.synthetic.piezo(60, 1000.0).with_train("0:2000")
    >>> model = hy.fit(data, "prandtl_ishlinskii", N=20)
    >>> model.fit["held_out_rms_percent"] < 2.0
    True
    >>> alone = hy.fit(data, hy.blocks.BoucWen(), free={"beta": True, "gamma": True, "n": (1.0, 3.0)}, starts=2)
    >>> sorted(alone.fit["free"])[:3]
    ['bouc_wen.beta', 'bouc_wen.gamma', 'bouc_wen.n']
    """
    from threadpoolctl import threadpool_limits

    from hystfmu.data.reader.reading import dataset_of
    from hystfmu.identify import fit, fit_graph
    from hystfmu.inverse import Inverses

    if purpose not in ("model", "inverse"):
        raise InputError(f"The purpose of a fit must be 'model' or 'inverse'. Got {purpose!r} instead.")
    data = data if isinstance(data, Dataset) else dataset_of(data)
    if wrong := next((n for n in options if n in ("model", "kind", "method")), None):
        raise InputError(
            f"The kind of model must be the second argument, fit(data, 'preisach'). Got {wrong!r} as a name."
        )
    inverses = Inverses()
    # small matrices: several threads wait for each other, up to twenty times longer on a loaded machine
    with threadpool_limits(1):
        if isinstance(key, str):
            if free is not None:
                raise InputError(f"The free parameters must be those of a graph. Got the kind {key!r}.")
            found = fit(data, key, seed, progress, inverses, purpose == "inverse", **options)
        else:
            found = fit_graph(data, key, free, seed, progress, **options)
        if purpose == "inverse" and (fault := inverses.fault(found)):
            raise InputError(f"{data.path or data.name}: The model {found.key} must have a useful inverse. {fault}")
        model = Model(found.key, found.graph, found.step, found.text, found.fit, found.provenance)
        model = held_out(model, data)
        return replace(model, fit={**model.fit, "evidence": evidence_of(model, data).to_dict()})


def evidence_of(model: Model, data: Dataset) -> Evidence:
    """Test a record for linear dynamics between the hysteresis and the measured output.

    Parameters
    ----------
    model : Model
        Model that was fitted to `data`. If it is a static part (creep may be included) in front of linear dynamics, the
        output of this static part is the input of the dynamics. For other models, the measured input u is the input of
        the dynamics.
    data : Dataset
        Record with a measured output.
    """
    from hystfmu.identify.evidence import evidence
    from hystfmu.inverse.dynamic import split

    parts = split(model)
    graph = model.graph if parts is None else parts.front.graph
    # lags of creep, an operator, pass the input at once, so that they count as static
    rates = ("function", "hysteretic")
    static = all(n.block.rate in rates or n.block.family == "operators" for n in graph.nodes)
    return evidence(data, run_along(graph, data) if static else None)


def held_out(model: Model, data: Dataset) -> Model:
    """Return the model with the errors on the rows after the training rows.

    If there are too few such rows, the model is returned without changes.
    """
    first = data.train.stop
    if len(data.t) - first < 4 or not np.ptp(data.y[first:]) > 0:
        return model
    found = model.score(data, (first, len(data.t)))
    # percent of the same span as the errors of the training rows
    told = {f"held_out_{k}": found[k] for k in ("rms", "max")}
    told |= {f"held_out_{k}_percent": 100 * found[k] / data.span for k in ("rms", "max")}
    return replace(model, fit={**model.fit, **told})
