"""Fit of a given kind of model: the steps that all kinds have in common.

These steps are the check of the data, the correction for a dead band, the call of ``build``, the simulation of the
fitted model, its errors and warnings, and the provenance. `hystfmu.identify.catalogue.Row` describes a kind. `build`
returns the graph and the number of fitted parameters. It can also return a dict with identified physical quantities,
``warnings``, and the searched parameters ``bounded`` (see `hystfmu.model.guards`).
"""

import platform
import time
from dataclasses import replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from hystfmu.base import InputError, Progress
from hystfmu.data import Dataset
from hystfmu.graph import Graph
from hystfmu.identify.catalogue import AUTO, METHODS, Built, method, resolve
from hystfmu.identify.cuts import one_run
from hystfmu.identify.features.plays import DEAD_BAND, behind_dead_band, dead_band, with_dead_band
from hystfmu.model import Model, errors, guards, run_along
from hystfmu.model.coverage import coverage, trained_range

WORST = 0.5  # largest accepted RMS error, relative to the span; a constant in the middle of the span is never worse
SMALLEST = 1e-100
"""Smallest permitted span of a signal. The largest permitted value is 1 / `SMALLEST`.

Outside these limits, squares overflow or become 0, and the solver for non-negative least squares ends the process.
"""
_LEAST = 2  # a column heading with fewer letters is not used as a description


def fit_one(data: Dataset, key: str, seed: int, progress: Progress, given: dict[str, Any]) -> Model:
    """Fit a model of the kind `key`. Parameters, result and errors are those of `hystfmu.identify.fit`."""
    kind = method(key)
    chosen = resolve(key, kind.options, given)
    check(data)
    if data.covariates and not kind.covariates:
        kinds = ", ".join(k for k in METHODS if k != AUTO and method(k).covariates)
        raise InputError(
            f"{data.path or data.name}: The data of {key} must have no covariates. Got "
            f"{', '.join(data.covariates.names)}, which {kinds} take."
        )
    started = time.perf_counter()
    if chosen.get(DEAD_BAND.name, 0.0) is None:
        chosen[DEAD_BAND.name] = dead_band(data.u[: data.train.stop])
    band = chosen.get(DEAD_BAND.name, 0.0)
    run = data if len(data.starts) == 1 or kind.records else one_run(data)
    # for small matrices, several threads wait for each other: on a busy computer a fit takes up to twenty times longer
    try:
        with threadpool_limits(1):
            graph, parameters, *more = kind.build(behind_dead_band(run, band) if band else run, chosen, seed, progress)
    except np.linalg.LinAlgError as e:
        raise InputError(
            f"{data.path or data.name}: The equations of a fit of the kind {key} must have a solution. Got the error "
            f"{str(e)!r} of LAPACK: take another kind, or data with more reversals."
        ) from None
    built = with_dead_band(graph, band), parameters, dict(more[0]) if more else {}
    given = {k: v for k, v in chosen.items() if v is not None}
    return finished(data, key, kind.text, built, time.perf_counter() - started, given, seed)


def finished(
    data: Dataset, key: str, text: str, built: Built, seconds: float, chosen: dict[str, Any], seed: int
) -> Model:
    """Return a model that consists of a fitted graph, its errors, its warnings and its provenance.

    If the simulation of the graph diverges, or its RMS error exceeds half of the span of y, an InputError is raised.
    """
    import scipy

    from hystfmu.base import __version__

    graph, parameters, found = built[0], built[1], dict(built[2])
    inputs = [replace(graph.inputs[0], text=_text("input", data.titles[0], data.unit_u, data.name)), *graph.inputs[1:]]
    outputs = [replace(graph.outputs[0], text=_text("output", data.titles[1], data.unit_y, data.name))]
    graph = Graph(graph.nodes, graph.wires, inputs, outputs, sort=False, step=graph.step)
    run, measured = run_along(graph, data), data.y[data.counted]
    y, finite = run[data.counted], bool(np.isfinite(run).all())
    reached = errors(y, measured, data.span)
    if not (finite and reached["rms"] <= WORST * data.span * (1 + 1e-9)):
        got = f"an error of {reached['rms_percent']:.3g} % of the span" if finite else "a run that diverges"
        raise InputError(
            f"{data.path or data.name}: A model of the kind {key} must follow the data. Got {got}: take another kind, "
            "or data with more reversals."
        )
    warned = [*found.pop("warnings", ()), *guards.drifts(measured - y, data.span)]
    if parameters >= len(y):
        warned.append(
            f"{parameters} parameters from {len(y)} training rows: the error on these rows does not predict errors on "
            "other rows"
        )
    covered = coverage(graph, data)
    warned += guards.excursion(key, graph, data)
    warned += guards.warnings(graph, data.h, found.pop("bounded", {}), covered)
    result = {
        **reached,
        "parameters": int(parameters),
        **({} if covered is None else {"coverage_percent": covered}),
        **found,
        **({"warnings": warned} if warned else {}),
        "seconds": round(seconds, 4),
    }
    provenance = {
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
    return Model(key, graph, data.h, text, result, provenance)


def check(data: Dataset) -> None:
    """Check that a model can be fitted to the data.

    An InputError is raised if the data have no output, if a value is too large, or if u, y or a covariate is constant.
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
            raise InputError(f"{where}: The {name} of the training rows must vary. Got the constant {only:g}.")
        if span < SMALLEST:
            raise InputError(
                f"{where}: The span of {name} in the training rows must be at least {SMALLEST:g}. Got {span:g} instead."
            )


def _text(port: str, title: str, unit: str, name: str) -> str:
    """Return the description of a port: the heading `title` of its column, or the name of the record, with the unit."""
    what = title if len(title) >= _LEAST else f"{port} of the record {name}"
    return f"{what}, in {unit}" if unit else what
