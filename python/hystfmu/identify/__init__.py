"""Identification: `fit(data, key, ...)` makes a Model from measured data.  One file of `methods` per kind."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.identify import auto, guards
from hystfmu.identify.catalogue import AUTO, METHODS, description, options
from hystfmu.identify.excitation import closed_loop, sensor_lag
from hystfmu.identify.excitation.minor_loops import examine
from hystfmu.identify.excitation.rest import places_memory, remembered, rest
from hystfmu.identify.memory import too_large
from hystfmu.identify.one import Progress, check, fit_one
from hystfmu.identify.options import resolve
from hystfmu.model import Model
from hystfmu.model.accuracy import errors

__all__ = ["METHODS", "description", "errors", "fit", "options"]


def fit(
    data: Dataset,
    key: str,
    seed: int = 0,
    progress: Progress | None = None,
    inverses: auto.Inverses | None = None,
    only_invertible: bool = False,
    **given: Any,
) -> Model:
    """Identify a model.

    Parameters
    ----------
    data : Dataset
        Measured data.  The model runs free from row 0; the residuals of `data.train` count.
    key : str
        Kind of model, one of `METHODS`.
    seed : int
        Seed of random starts; the same seed gives the same model.
    progress : function, optional
        Called with the fraction done, 0..1.
    inverses : Inverses, optional
        Tells ``auto`` which inverse a model has.
    only_invertible : bool
        Whether only models with a useful inverse compete in ``auto``.
    **given
        Options of the method; `options(key)` lists them.

    Returns
    -------
    Model
        Model with the key of the method (after ``auto``, of the chosen one).  `fit` holds rms and max (unit of measure
        of y), rms_percent and max_percent (of the span of y in the training rows), parameters (their number), seconds;
        for a network coverage_percent (`hystfmu.model.coverage`); warnings, if any; if y lags u, lag_rows, dead_rows
        (those without any answer, where kinks of u tell) and lag (the same in words); after ``auto`` also memory,
        loops, gap_percent and rate.  `provenance` holds data, rows, options and versions.

    Raises
    ------
    InputError
        Unknown method or option, value out of range, data without output or without variation, a record that takes more
        than half of the memory.
    """
    report = progress or (lambda fraction: None)
    resolve(key, options(key), given)
    check(data)
    if why := too_large(len(data.t), key, given):
        raise InputError(f"{data.path or data.name}: {why}.")
    if key != AUTO:
        placed = "u0" in given or "start" in given or not places_memory(key)
        memory = {} if placed else remembered(key, rest(data), data)
        return _examined(fit_one(data, key, seed, report, {**memory, **given}), data)
    started = time.perf_counter()
    choice = auto.choose(data, seed, report, inverses, only_invertible)
    model = fit_one(data, choice.method, seed, lambda fraction: None, choice.options)
    warned = [*choice.fit["warnings"], *model.fit.get("warnings", [])]
    found = {**model.fit, **choice.fit, "warnings": warned, "seconds": round(time.perf_counter() - started, 4)}
    return _examined(replace(model, fit=found, provenance={**model.provenance, **choice.provenance}), data)


def _examined(model: Model, data: Dataset) -> Model:
    """Add what the record shows: a lag of the output; warnings of poor excitation, lag, an input that follows."""
    seen, (lagging, late) = examine(data.longest()), sensor_lag.told(data, model.fit["rms_percent"])
    static = [] if guards.follows_late(model.graph) else [*seen.coarse, *late]
    warned = [*seen.warnings, *static, *closed_loop.warnings(data)]
    found = {**model.fit, **lagging}
    if warned:
        found["warnings"] = [*model.fit.get("warnings", []), *warned]
    return replace(model, fit=found)
