"""Identification: `fit(data, key, ...)` makes a Model from measured data.  One kind of model a file, in `methods`."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from hystfmu.data import Dataset
from hystfmu.identify import auto
from hystfmu.identify.catalogue import AUTO, METHODS, options
from hystfmu.identify.one import Progress, check, fit_one
from hystfmu.identify.options import resolve
from hystfmu.model import Model
from hystfmu.model.accuracy import errors

__all__ = ["METHODS", "errors", "fit", "options"]


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
        network coverage_percent (of its input space: `hystfmu.model.coverage`), where y drifts or rows are few
        warnings, after ``auto`` also memory, loops, gap_percent, rate and more warnings; `provenance` holds data, rows,
        options and versions.

    Raises
    ------
    InputError
        Unknown method or option, value out of range, data without output or without variation.
    """
    report = progress or (lambda fraction: None)
    if key != AUTO:
        return fit_one(data, key, seed, report, given)
    resolve(key, options(key), given)
    check(data)
    started = time.perf_counter()
    choice = auto.choose(data, seed, report)
    model = fit_one(data, choice.method, seed, lambda fraction: None, choice.options)
    warned = [*choice.fit["warnings"], *model.fit.get("warnings", [])]
    found = {**model.fit, **choice.fit, "warnings": warned, "seconds": round(time.perf_counter() - started, 4)}
    return replace(model, fit=found, provenance={**model.provenance, **choice.provenance})
