"""Identification of a given kind of model: check the data, build, run free, compute errors, record provenance.

A kind of model is a module of `hystfmu.identify.methods` with a line ``TEXT``, a table ``OPTIONS`` and a function
``build(data, options, seed, progress)``. `build` returns the graph, the number of fitted parameters and, optionally, a
dict of identified physical quantities, with ``warnings`` and ``bounded`` (`hystfmu.identify.guards`). This module does
everything that is common to all kinds, including the dead band.
"""

from __future__ import annotations

import platform
import time
from dataclasses import replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from hystfmu.base.arrays import Array, Progress
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.graph import Graph
from hystfmu.identify import guards
from hystfmu.identify.catalogue import AUTO, METHODS, Built, method, resolve, takes_covariates, takes_records
from hystfmu.identify.excitation import drift
from hystfmu.identify.features.plays import DEAD_BAND, behind_dead_band, dead_band, with_dead_band
from hystfmu.identify.one_run import one_run
from hystfmu.model import Model, run_along
from hystfmu.model.accuracy import errors, rms
from hystfmu.model.coverage import coverage, trained_range

WORST = 0.5  # of the span: no constant has a larger RMS error
SMALLEST = 1e-100
"""Least span of the data; 1 / `SMALLEST` is the largest value.

Outside these limits squares overflow or become 0, and NNLS aborts the process.
"""
_LEAST = 2  # letters of a heading that says more than the name of the port


def fit_one(data: Dataset, key: str, seed: int, progress: Progress, given: dict[str, Any]) -> Model:
    """Identify a model of the kind `key`; parameters, result and errors as in `hystfmu.identify.fit`."""
    module = method(key)
    chosen = resolve(key, module.OPTIONS, given)
    check(data)
    if data.covariates and not takes_covariates(key):
        kinds = ", ".join(k for k in METHODS if k != AUTO and takes_covariates(k))
        raise InputError(
            f"{data.path or data.name}: The data of {key} must have no covariates. Got "
            f"{', '.join(data.covariates.names)}, which {kinds} take."
        )
    started = time.perf_counter()
    if chosen.get(DEAD_BAND.name, 0.0) is None:
        chosen[DEAD_BAND.name] = dead_band(data.u[: data.train.stop])
    band = chosen.get(DEAD_BAND.name, 0.0)
    # small matrices: several threads wait for each other, up to twenty times longer on a loaded machine
    with threadpool_limits(1):
        behind = behind_dead_band(data if takes_records(key) else one_run(data), band)
        graph, parameters, *more = module.build(behind, chosen, seed, progress)
    built = with_dead_band(graph, band), parameters, dict(more[0]) if more else {}
    given = {k: v for k, v in chosen.items() if v is not None}
    return finished(data, key, module.TEXT, built, time.perf_counter() - started, given, seed)


def finished(
    data: Dataset, key: str, text: str, built: Built, seconds: float, chosen: dict[str, Any], seed: int
) -> Model:
    """Run a fitted graph free, compute its errors, check what the data support, record the provenance.

    If the run diverges or does not follow the data, an InputError is raised.
    """
    graph, parameters, found = with_texts(built[0], data), built[1], dict(built[2])
    y = run_along(graph, data)
    _check_run(key, y, data)
    rows = len(data.y[data.counted])
    warned = [*found.pop("warnings", ()), *drift.warnings((data.y - y)[data.counted], data.span)]
    if parameters >= rows:
        warned.append(
            f"{parameters} parameters from {rows} train rows: the error on these rows does not predict other errors"
        )
    covered = coverage(graph, data)
    warned += guards.warnings(key, graph, data, found.pop("bounded", {}), covered)
    result = {
        **errors(y[data.counted], data.y[data.counted], data.span),
        "parameters": int(parameters),
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

    An InputError is raised for data without output, for a value that is too large, and if u, y or a covariate does not
    vary.
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

    from hystfmu.base import __version__

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


def with_texts(graph: Graph, data: Dataset) -> Graph:
    """Describe input and output by the headings of the record, else by its name."""
    inputs = [replace(graph.inputs[0], text=_text(data, 0, "input", data.unit_u)), *graph.inputs[1:]]
    outputs = [replace(graph.outputs[0], text=_text(data, 1, "output", data.unit_y)), *graph.outputs[1:]]
    return Graph(graph.nodes, graph.wires, inputs, outputs, sort=False, step=graph.step)


def _text(data: Dataset, k: int, port: str, unit: str) -> str:
    title = data.titles[k]
    what = title if len(title) >= _LEAST else f"{port} of the record {data.name}"
    return f"{what}, in {unit}" if unit else what
