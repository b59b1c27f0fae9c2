"""Identification: `fit(data, key, ...)` makes a Model from measured data.  One method per file, loaded on first use.

A method's module has a table ``OPTIONS`` and a function ``build(data, options, seed, progress)`` that returns the
graph, the number of fitted parameters and, where a method has any, a dict of the physical quantities found; running,
measuring and recording the model is the same for all and done here, and so is the dead band of those that have one.
"""

from __future__ import annotations

import importlib
import platform
import time
from collections.abc import Callable
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from hystfmu.accuracy import errors
from hystfmu.coverage import coverage
from hystfmu.data import Dataset
from hystfmu.errors import InputError
from hystfmu.identify import dead_band, drift
from hystfmu.identify.options import Option, resolve
from hystfmu.model import Model

__all__ = ["METHODS", "errors", "fit", "options"]

Progress = Callable[[float], None]
SMALLEST = (
    1e-100  # span, and one over the largest value: beyond, squares overflow or vanish and NNLS aborts the process
)

METHODS: dict[str, tuple[str, str]] = {
    "prandtl_ishlinskii": ("prandtl_ishlinskii", "weighted plays, non-negative least squares; exact inverse"),
    "prandtl_ishlinskii_asym": ("prandtl_ishlinskii_asym", "plays, dead zones and creep of the input, least squares"),
    "prandtl_ishlinskii_rate": ("prandtl_ishlinskii_rate", "the same, bent by the lagged input too; ridge found"),
    "zhao_tan_mlp": ("zhao_tan_mlp", "Zhao-Tan operator and a network on (x, h)"),
    "constraint_factor_mlp": ("constraint_factor_mlp", "constraint-factor operator and a network on (x, h)"),
    "fitted_operator_mlp": ("fitted_operator_mlp", "fitted weighted plays and a network on (x, their sum)"),
    "play_bank_mlp": ("play_bank_mlp", "bank of plays and a network on them"),
    "krasnoselskii_pokrovskii": ("krasnoselskii_pokrovskii", "Krasnosel'skii-Pokrovskii kernels, weights >= 0"),
    "preisach": ("preisach", "density of relays on a grid, weights >= 0: the Everett function"),
    "polynomial_narx": ("polynomial_narx", "polynomial of the lagged input and Zhao-Tan operator, least squares"),
    "bouc_wen": ("bouc_wen", "Bouc-Wen grey box, nonlinear least squares"),
    "duhem": ("duhem", "polynomial slopes for rising and falling input, least squares, refined on the free run"),
    "rate_mlp": ("rate_mlp", "network on the input, its rate and a bank of plays"),
    "g0_prandtl_ishlinskii": ("g0_prandtl_ishlinskii", "weighted plays, then G0(s) with delay, variable projection"),
    "bouc_wen_oscillator": ("bouc_wen_oscillator", "oscillator with a Bouc-Wen force, grey box, least squares"),
    "auto": ("auto", "of those that suit the memory in the data, the best on the last 30 % of the training rows"),
}


def _module(key: str) -> ModuleType:
    if key not in METHODS:
        raise InputError(f"no model {key!r}; there are: {', '.join(METHODS)}")
    return importlib.import_module(f"hystfmu.identify.{METHODS[key][0]}")


def options(key: str) -> tuple[Option, ...]:
    """The options of the method `key`.

    Raises
    ------
    InputError
        Unknown method.
    """
    table: tuple[Option, ...] = _module(key).OPTIONS
    return table


def fit(data: Dataset, key: str, seed: int = 0, progress: Progress | None = None, **given: Any) -> Model:
    """Identify a model.

    Parameters
    ----------
    data : Dataset
        The model runs free from row 0; the residuals of `data.train` count.
    key : str
        A key of `METHODS`.
    seed : int
        Seed of random starts; the same seed gives the same model.
    progress : function, optional
        Called with the fraction done, 0..1.
    **given
        Options of the method; `options(key)` lists them.

    Returns
    -------
    Model
        Its key is that of the method (for ``auto`` of the one chosen).  `fit` holds rms, max (unit of y), rms_percent,
        max_percent (percent of the span of y in the training rows), parameters (their number), seconds, with a
        network coverage_percent (of its input space: `hystfmu.coverage`), where y drifts or rows are few warnings,
        after ``auto`` also memory, loops, gap_percent, rate and more warnings; `provenance` holds data, rows,
        options and versions.

    Raises
    ------
    InputError
        Unknown method or option, value out of range, data without output or without variation.
    """
    module = _module(key)
    chosen = resolve(key, module.OPTIONS, given)
    _check(data)
    started = time.perf_counter()
    if key == "auto":
        choice = module.choose(data, seed, progress or (lambda fraction: None))
        model = fit(data, choice.method, seed, **choice.options)
        warned = [*choice.fit["warnings"], *model.fit.get("warnings", [])]
        told = {**model.fit, **choice.fit, "warnings": warned, "seconds": round(time.perf_counter() - started, 4)}
        return replace(model, fit=told, provenance={**model.provenance, **choice.provenance})
    if chosen.get(dead_band.OPTION.name, 0.0) is None:
        chosen[dead_band.OPTION.name] = dead_band.half_width(data.u[: data.train.stop])
    band = chosen.get(dead_band.OPTION.name, 0.0)
    # small matrices: more threads only wait for each other, up to twenty times longer beside other work
    with threadpool_limits(1):
        behind = dead_band.behind(data, band)
        graph, parameters, *more = module.build(behind, chosen, seed, progress or (lambda fraction: None))
    graph = dead_band.in_front(graph, band)
    seconds = time.perf_counter() - started
    y = graph.run(data.u, data.h)
    rows = data.train.stop - data.train.start
    warned = drift.warnings((data.y - y)[data.train], data.span)
    if parameters >= rows:
        warned.append(
            f"{parameters} parameters from {rows} train rows: the error on these rows says nothing about others"
        )
    covered = coverage(graph, data.u, data.h, data.train)
    result = {
        **errors(y[data.train], data.y[data.train], data.span),
        "parameters": int(parameters),
        **({} if covered is None else {"coverage_percent": covered}),
        **(more[0] if more else {}),
        **({"warnings": warned} if warned else {}),
    }
    return Model(
        key,
        graph,
        data.h,
        METHODS[key][1],
        {**result, "seconds": round(seconds, 4)},
        _provenance(data, {k: v for k, v in chosen.items() if v is not None}, seed),
    )


def _check(data: Dataset) -> None:
    where = data.path or data.name
    if not data.has_output:
        raise InputError(f"{where}: no output was measured, so there is nothing to fit")
    for name, column in (("u", data.u), ("y", data.y)):
        large = np.abs(column) > 1 / SMALLEST
        if large.any():
            row = int(np.argmax(large))
            raise InputError(
                f"{where}: row {row}, {name}: a fit takes values up to {1 / SMALLEST:g}; got {column[row]:g}"
            )
        span = np.ptp(column[data.train])
        if not span > 0:
            raise InputError(f"{where}: {name} is constant ({column[data.train][0]:g}) in the train rows")
        if span < SMALLEST:
            raise InputError(f"{where}: {name}: a fit takes spans from {SMALLEST:g}; got {span:g} in the train rows")


def _provenance(data: Dataset, chosen: dict[str, Any], seed: int) -> dict[str, Any]:
    import scipy

    from hystfmu import __version__

    return {
        "data": data.name,
        "sha256": data.sha256,
        "rows": len(data.t),
        "train": f"{data.train.start}:{data.train.stop}",
        "span_u": [float(data.u.min()), float(data.u.max())],
        "seed": seed,
        "options": chosen,
        "versions": {
            "hystfmu": __version__,
            "python": platform.python_version(),
            "numpy": np.__version__,
            "scipy": scipy.__version__,
        },
    }
