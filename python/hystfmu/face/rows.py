"""Errors of a model on the parts of a data set: training rows, held-out rows, each record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.model import Model, run_along
from hystfmu.model.accuracy import errors
from hystfmu.report.page import Table, figure_of

LEAST = 4  # rows with a varying output that an error needs


@dataclass(frozen=True)
class Part:
    """A part of the rows: its name, and the errors on these rows (`hystfmu.model.accuracy.errors`)."""

    name: str
    rows: slice
    errors: dict[str, float]


def free_run(model: Model, data: Dataset) -> Array:
    """Return the output of a model, shape (n,); each record of the data starts from the initial state."""
    return run_along(model.graph, data)


def parts(y: Array, data: Dataset, fitted: bool) -> list[Part]:
    """Compute the errors of an output y (n,) of a model.

    Parameters
    ----------
    y : array, shape (n,)
        Output of the model.
    data : Dataset
        Data with a measured output.
    fitted : bool
        Whether the model was fitted to the training rows. If True, percent errors refer to the span of y in the
        training rows. If False, training rows are not a separate part, and percent errors refer to the span of y in all
        rows.
    """
    n, train = len(data.t), data.train
    named: list[tuple[str, slice]] = []
    whole = (train.start, train.stop) == (0, n)
    if fitted:
        named.append(("training rows", train))
        named += [("held-out rows", slice(*ends)) for ends in ((0, train.start), (train.stop, n))]
    if not fitted:
        named.append(("all rows", slice(0, n)))
    if len(data.starts) > 1:
        named += [(f"record {k}", rows) for k, rows in enumerate(data.records, 1)]
    span = data.span if fitted and not whole else float(np.ptp(data.y))
    if not span > 0:
        return []
    return [
        Part(name, rows, errors(y[rows], data.y[rows], span)) for name, rows in named if rows.stop - rows.start >= LEAST
    ]


def table_of(found: list[Part], unit: str) -> Table:
    """Make a table of errors. `unit` is the unit of measure of y."""
    of = f" ({unit})" if unit else ""
    head = ("errors", "rows", "RMS %FS", "max %FS", f"RMS{of}", f"max{of}")
    keys = ("rms_percent", "max_percent", "rms", "max")
    rows = [(p.name, f"{p.rows.start}:{p.rows.stop}", *(figure_of(p.errors[k], k) for k in keys)) for p in found]
    return Table(head, rows)


def held_out_errors(y: Array, data: Dataset) -> Array:
    """Return measured minus model on the rows outside the training rows, shape (m,)."""
    e = data.y - y
    return np.concatenate([e[: data.train.start], e[data.train.stop :]])
