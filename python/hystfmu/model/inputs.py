"""Input rows of a model: the driving input u, and the covariates of the model by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.graph import Graph


def beside(graph: Graph) -> tuple[str, ...]:
    """Return the names of the covariates of a graph: all inputs after the first."""
    return tuple(i.name for i in graph.inputs[1:])


def input_rows(graph: Graph, u: Array | Sequence[float], given: Mapping[str, ArrayLike] | None) -> Array:
    """Return the input rows of a graph.

    Parameters
    ----------
    graph : Graph
    u : array, shape (n,), or (n, n_inputs) for all inputs
        Driving input.
    given : dict of str to array or float, optional
        Covariates by name, shape (n,); a number is held.

    Returns
    -------
    array, shape (n,) for one input, else (n, n_inputs)

    Raises
    ------
    InputError
        A covariate is missing or unknown, or has another number of rows.
    """
    rows, names = np.asarray(u, dtype=np.float64), beside(graph)
    if given is None and (rows.ndim > 1 or not names):
        return rows
    known = {} if given is None else given
    for name in known:
        if name not in names:
            raise InputError(f"A covariate of the model must be one of {', '.join(names) or 'none'}. Got {name!r}.")
    missing = [name for name in names if name not in known]
    if missing:
        raise InputError(f"The covariates of the model must be given: {', '.join(names)}. Got no {missing[0]!r}.")
    columns = [rows]
    for name in names:
        column = np.asarray(known[name], dtype=np.float64)
        if column.shape not in ((), rows.shape):
            raise InputError(
                f"The covariate {name!r} must be a number or have {len(rows)} rows. Got shape {column.shape} instead."
            )
        columns.append(np.broadcast_to(column, rows.shape))
    return np.column_stack(columns)


def with_starts(graph: Graph, u: Array | Sequence[float]) -> Array:
    """Return the input rows of a graph, (n,) or (n, n_inputs); covariates keep their start values."""
    return input_rows(graph, u, {i.name: i.start for i in graph.inputs[1:]})


def rows_of(graph: Graph, data: Dataset) -> Array:
    """Return the input rows of a graph on a record: u, and the covariates that the graph takes, by name.

    Raises
    ------
    InputError
        The record lacks a covariate, or states it in another unit of measure.
    """
    columns = {name: (unit, values) for name, unit, values in data.covariates}
    where = data.path or data.name
    chosen: dict[str, Array] = {}
    for port in graph.inputs[1:]:
        if port.name not in columns:
            raise InputError(
                f"{where}: The data must have the covariates of the model, {', '.join(beside(graph))}. "
                f"Got no {port.name!r}: name its column (--covariate)."
            )
        unit, chosen[port.name] = columns[port.name]
        if unit and port.unit and unit != port.unit:
            raise InputError(
                f"{where}: The covariate {port.name!r} must be in {port.unit}, as in the model. Got {unit} instead."
            )
    return input_rows(graph, data.u, chosen or None)


def run_along(graph: Graph, data: Dataset) -> Array:
    """Run a graph on every record of the data from a fresh start, shape (n,) or (n, n_outputs)."""
    return data.along(lambda rows: graph.run(rows, data.h), inputs=rows_of(graph, data))
