"""Identification of a given kind of model: check the data, build, run free, compute errors, record provenance.

A kind of model is a module of `hystfmu.identify.methods` with a line ``TEXT``, a table ``OPTIONS`` and a function
``build(data, options, seed, progress)``.  `build` returns the graph, the number of fitted parameters and, optionally, a
dict of identified physical quantities, with ``warnings`` and ``bounded`` (`hystfmu.identify.guards`).  Everything else
is common to all kinds and done here, including the dead band.
"""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.graph import Graph
from hystfmu.identify import guards
from hystfmu.identify.catalogue import AUTO, METHODS, method, takes_covariates, takes_records
from hystfmu.identify.excitation import drift
from hystfmu.identify.features import dead_band
from hystfmu.identify.options import resolve
from hystfmu.identify.port_texts import with_texts
from hystfmu.model import Model
from hystfmu.model.accuracy import errors, rms
from hystfmu.model.coverage import coverage
from hystfmu.model.inputs import run_along
from hystfmu.model.trained_range import trained_range

Progress = Callable[[float], None]
WORST = 0.5  # of the span: no constant has a larger RMS error
SMALLEST = 1e-100
"""Least span, and one over the largest value: beyond them squares overflow or vanish, and NNLS aborts the process."""


def fit_one(data: Dataset, key: str, seed: int, progress: Progress, given: dict[str, Any]) -> Model:
    """Identify a model of the kind `key`; parameters, result and errors as in `hystfmu.identify.fit`."""
    module = method(key)
    chosen = resolve(key, module.OPTIONS, given)
    check(data)
    if len(data.starts) > 1 and not takes_records(key):
        kinds = ", ".join(k for k in METHODS if k != AUTO and takes_records(k))
        raise InputError(
            f"{data.path or data.name}: The data of {key} must be one record. Got {len(data.starts)} records, which "
            f"{kinds} take."
        )
    if data.covariates and not takes_covariates(key):
        kinds = ", ".join(k for k in METHODS if k != AUTO and takes_covariates(k))
        raise InputError(
            f"{data.path or data.name}: The data of {key} must have no covariates. Got "
            f"{', '.join(data.covariates.names)}, which {kinds} take."
        )
    started = time.perf_counter()
    if chosen.get(dead_band.OPTION.name, 0.0) is None:
        chosen[dead_band.OPTION.name] = dead_band.half_width(data.u[: data.train.stop])
    band = chosen.get(dead_band.OPTION.name, 0.0)
    # small matrices: several threads wait for each other, up to twenty times longer on a loaded machine
    with threadpool_limits(1):
        behind = dead_band.behind(data, band)
        graph, parameters, *more = module.build(behind, chosen, seed, progress)
    fitted = Fitted(dead_band.in_front(graph, band), parameters, dict(more[0]) if more else {}, started)
    return finished(data, key, module.TEXT, fitted, {k: v for k, v in chosen.items() if v is not None}, seed)


@dataclass(frozen=True)
class Fitted:
    """Result of an identification before its errors are known.

    Attributes
    ----------
    graph : Graph
    parameters : int
        Number of fitted parameters.
    found : dict
        Entries of `Model.fit`, with ``warnings`` and ``bounded`` (`hystfmu.identify.guards`).
    started : float
        Start time (`time.perf_counter`).
    """

    graph: Graph
    parameters: int
    found: Mapping[str, Any]
    started: float


def finished(data: Dataset, key: str, text: str, fitted: Fitted, chosen: dict[str, Any], seed: int) -> Model:
    """Run a fitted graph free, compute its errors, check what the data support, record the provenance.

    Raises
    ------
    InputError
        The run diverges or does not follow the data.
    """
    seconds = time.perf_counter() - fitted.started
    graph, found = with_texts(fitted.graph, data), dict(fitted.found)
    y = run_along(graph, data)
    _check_run(key, y, data)
    rows = len(data.y[data.counted])
    warned = [*found.pop("warnings", ()), *drift.warnings((data.y - y)[data.counted], data.span)]
    if fitted.parameters >= rows:
        warned.append(
            f"{fitted.parameters} parameters from {rows} train rows: the error on these rows does not predict other "
            "errors"
        )
    covered = coverage(graph, data)
    warned += guards.warnings(key, graph, data, found.pop("bounded", {}), covered)
    result = {
        **errors(y[data.counted], data.y[data.counted], data.span),
        "parameters": int(fitted.parameters),
        **({} if covered is None else {"coverage_percent": covered}),
        **found,
        **({"warnings": warned} if warned else {}),
        "seconds": round(seconds, 4),
    }
    return Model(key, graph, data.h, text, result, _provenance(data, chosen, seed))


def _check_run(key: str, y: Array, data: Dataset) -> None:
    """Refuse a diverging model, whose error exceeds half the span."""
    e = (y - data.y)[data.counted]
    if np.isfinite(y).all() and rms(e) <= WORST * data.span * (1 + 1e-9):
        return
    got = f"an error of {100 * rms(e) / data.span:.3g} % of the span" if np.isfinite(y).all() else "a run that diverges"
    raise InputError(
        f"{data.path or data.name}: A model of the kind {key} must follow the data. Got {got}: take another kind, or "
        "data with more reversals."
    )


def check(data: Dataset) -> None:
    """Check that a model can be fitted to the data.

    Raises
    ------
    InputError
        No output was measured, a value is too large, or u or y does not vary.
    """
    where = data.path or data.name
    if not data.has_output:
        raise InputError(f"{where}: The data must have a measured output. Got none: name its column (--output).")
    for name, column in (("u", data.u), ("y", data.y), *((name, values) for name, _, values in data.covariates)):
        large = np.abs(column) > 1 / SMALLEST
        if large.any():
            row = int(np.argmax(large))
            raise InputError(
                f"{data.place(row)}: The values of {name} must be at most {1 / SMALLEST:g}. "
                f"Got {column[row]:g} instead."
            )
        span = np.ptp(column[data.train])
        if not span > 0:
            only = column[data.train][0]
            raise InputError(f"{where}: The {name} of the train rows must vary. Got the constant {only:g}.")
        if span < SMALLEST:
            raise InputError(
                f"{where}: The span of {name} in the train rows must be at least {SMALLEST:g}. Got {span:g} instead."
            )


def _provenance(data: Dataset, chosen: dict[str, Any], seed: int) -> dict[str, Any]:
    import scipy

    from hystfmu import __version__

    return {
        "data": data.name,
        "sha256": data.sha256,
        "rows": len(data.t),
        "train": f"{data.train.start}:{data.train.stop}",
        **({"starts": list(data.starts)} if len(data.starts) > 1 else {}),
        "span_u": [float(data.u.min()), float(data.u.max())],
        **trained_range(data),
        **({"span_covariates": data.covariates.ranges} if data.covariates else {}),
        "seed": seed,
        "options": chosen,
        "versions": {
            "hystfmu": __version__,
            "python": platform.python_version(),
            "numpy": np.__version__,
            "scipy": scipy.__version__,
        },
    }
