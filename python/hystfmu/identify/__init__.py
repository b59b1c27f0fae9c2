"""Identification of models from measured data. The folder `methods` contains the kinds of model."""

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from hystfmu.base import InputError, Progress, silent
from hystfmu.data import Dataset
from hystfmu.graph import Graph
from hystfmu.graph.blocks import Block
from hystfmu.identify import auto
from hystfmu.identify.catalogue import AUTO, METHODS, description, options, resolve, too_large
from hystfmu.identify.estimate import graph_fit
from hystfmu.identify.estimate.free import Spec, plain, read_graph
from hystfmu.identify.excitation import timing
from hystfmu.identify.excitation.minor_loops import Excitation, examine
from hystfmu.identify.excitation.rest import places_memory, remembered, rest
from hystfmu.identify.one import check, finished, fit_one
from hystfmu.model import Model, errors, guards

__all__ = ["GRAPH", "METHODS", "description", "errors", "fit", "fit_graph", "options"]

GRAPH = "graph"
"""Key of a model that was made by `fit_graph`."""


def fit(
    data: Dataset,
    key: str,
    seed: int = 0,
    progress: Progress | None = None,
    inverses: auto.Inverses | None = None,
    only_invertible: bool = False,
    **given: Any,
) -> Model:
    """Fit a model of a given kind to data.

    Parameters
    ----------
    data, seed, progress
        See `hystfmu.fit`.
    key : str
        Kind of model, one of `METHODS`. `options(key)` lists its options `given`.
    inverses, only_invertible
        Object by which ``auto`` finds out whether a model has an inverse, and whether ``auto`` compares only models
        with a useful inverse.

    Raises
    ------
    InputError
        For the reasons of `hystfmu.fit`, or if the fit needs more than half of the memory of the computer.

    Notes
    -----
    `fit` of the result contains the errors ``rms`` and ``max`` in the unit of measure of y, the same errors
    ``rms_percent`` and ``max_percent`` in percent of the span of y in the training rows, the number of ``parameters``,
    the duration ``seconds``, and any ``warnings``. For a network it also contains ``coverage_percent``
    (`hystfmu.model.coverage`). If y lags u, it also contains the lag as ``lag_rows`` and as the text ``lag``, and the
    dead time in rows as ``dead_rows``, if the response to kinks of u shows the dead time. After ``auto`` it also
    contains ``memory``, ``loops``, ``gap_percent`` and ``rate`` (see `hystfmu.identify.auto.choose`). `provenance`
    contains the origin of the data, the rows, the options and the versions of the software.
    """
    report = progress or silent
    resolve(key, options(key), given)
    check(data)
    if why := too_large(len(data.t), key, given):
        raise InputError(f"{data.path or data.name}: {why}.")
    with threadpool_limits(1):  # also for the regressions on the record; see hystfmu.identify.one
        if key == AUTO:
            model = auto.choose(data, seed, report, inverses, only_invertible)
        else:
            placed = "u0" in given or "start" in given or not places_memory(key)
            memory = {} if placed else remembered(key, rest(data), data)
            model = fit_one(data, key, seed, report, {**memory, **given})
        seen, late = examine(data.longest()), timing.told(data, model.fit["rms_percent"])
        return _told(model, seen, late, timing.feedback(data))


def fit_graph(
    data: Dataset,
    graph: Graph | Block | Path,
    free: Mapping[str, Spec] | None = None,
    seed: int = 0,
    progress: Progress | None = None,
    **given: Any,
) -> Model:
    """Fit the free parameters of a graph of blocks to data.

    Parameters
    ----------
    data, graph, free, seed, progress, given
        See `hystfmu.fit`, which calls the graph `key` and `given` the options.

    Raises
    ------
    InputError
        For the reasons of `hystfmu.fit`.

    Notes
    -----
    `graph` may be the path of a file that contains a graph and its free parameters. From a single block, a graph of
    three parts is built: a scaling of the input to [-1, 1], the block, and a weighted sum of its outputs with an
    offset. The parameters of a single block have names without the prefix ``node.``. By default, all its real
    parameters without a given value are free, except redundant parameters, whose effect is a linear combination of the
    effects of others. The key of the result is ``graph``.
    """
    chosen = resolve("a graph", graph_fit.OPTIONS, given)
    check(data)
    if isinstance(graph, Path):
        if free is not None:
            raise InputError(
                f"{graph}: The free parameters must be those of the file. Got a file and further free parameters."
            )
        graph, free = read_graph(graph)
    started, alone = time.perf_counter(), isinstance(graph, Block)
    if isinstance(graph, Block):
        name = graph.node.name
        graph, usual = graph_fit.around(graph.node, data)
        given_free = usual if free is None else graph_fit.named(name, free)
    elif free is None:
        raise InputError("The free parameters of a graph must be named, e.g. free={'node.parameter': True}. Got none.")
    else:
        given_free = dict(free)
    with threadpool_limits(1):
        found = graph_fit.fit_graph(data, graph, given_free, chosen, seed, progress or silent, alone and free is None)
        model = finished(data, GRAPH, graph_fit.TEXT, found, time.perf_counter() - started, chosen, seed)
        kept = {k: plain(v) for k, v in given_free.items() if k not in found[2].get("held", ())}
        seen, late = examine(data.longest()), timing.told(data, model.fit["rms_percent"])
        model = _told(model, seen, late, timing.feedback(data))
        return replace(model, provenance={**model.provenance, "free": kept})


def _told(model: Model, seen: Excitation, lag: tuple[dict[str, Any], list[str]], feedback: list[str]) -> Model:
    """Add the lag of the output, and warnings about excitation, lag and feedback, to the `fit` of a model."""
    static = [] if guards.follows_late(model.graph) else [*seen.coarse, *lag[1]]
    warned = [*seen.warnings, *static, *feedback]
    found = {**model.fit, **lag[0]}
    if warned:
        found["warnings"] = [*model.fit.get("warnings", []), *warned]
    return replace(model, fit=found)
