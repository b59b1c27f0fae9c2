"""Models: a graph of blocks with values, provenance and errors of the fit, stored as `*.model.toml`; their runs.

The first input of a graph is the driving input u. All further inputs are covariates of the model, by name.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from hystfmu.base.arrays import Array
from hystfmu.base.calls import checked
from hystfmu.base.errors import InputError
from hystfmu.base.files import check, check_format, load_toml, write_toml
from hystfmu.data import Dataset
from hystfmu.data.reader.arrays import Columns, is_frame
from hystfmu.graph import Graph
from hystfmu.graph.tables import GraphTable, graph_tables

FORMAT = 1
"""Version of the keys of a model file. A reader refuses newer versions, and states a remedy for older versions."""
_TIME = re.compile(rb"^seconds = .*\n", re.MULTILINE)  # of a fit: no two take the same


class _File(GraphTable):
    format: Literal[1]
    key: str
    text: str = ""
    step: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    fit: dict[str, Any] = Field({})
    provenance: dict[str, Any] = Field({})


@checked
@dataclass(frozen=True)
class Model:
    """A model: blocks with values, the origin of the values, and errors of the fit.

    A function that changes a model returns the class that it got. `hystfmu.Model` adds the verbs of the rooms above.

    Parameters
    ----------
    key, graph, step, text, fit, provenance
        See `hystfmu.Model`.
    """

    key: str
    graph: Graph
    step: float | None = None
    text: str = ""
    fit: dict[str, Any] = field(default_factory=dict)
    provenance: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.step is not None and self.graph.step != self.step:  # Model Exchange reads the step from the block file
            object.__setattr__(self, "graph", self.graph.with_step(self.step))

    def predict(
        self,
        u: ArrayLike | Dataset | Columns,
        h: float | None = None,
        covariates: Mapping[str, ArrayLike] | None = None,
    ) -> Array:
        """Simulate the model from its initial state, without use of measured outputs.

        Row 0 is the output after initialisation with ``u[0]``; row k is the output of an FMU after set u_k,
        doStep(t_{k-1}, h), get y.

        Parameters
        ----------
        u : array, shape (n,), Dataset or data frame
            Input. A data set contains step and covariates; each of its records starts from the initial state.
        h : float, optional
            Step (s) of an array. The default is the step of the model, or 1 s if the model has no step.
        covariates : dict of str to array or float, optional
            Further inputs of the model for an array, by name, shape (n,). A number is constant over all rows.

        Returns
        -------
        array, shape (n,)

        Raises
        ------
        InputError
            A value is not finite, a covariate is missing or unknown, or the step is invalid for a block.

        Examples
        --------
        >>> import hystfmu as hy
        >>> data = hy.synthetic.piezo(60, 1000.0)
        >>> model = hy.fit(data, "prandtl_ishlinskii")
        >>> bool((model.predict(data) == model.predict(data.u, data.h)).all())
        True
        """
        from hystfmu.data.reader.reading import dataset_of

        if (not isinstance(u, Dataset) and not is_frame(u)) or isinstance(u, np.ndarray):
            rows = input_rows(self.graph, np.asarray(u, dtype=np.float64), covariates)
            return self.graph.run(rows, h if h is not None else self.step if self.step is not None else 1.0)
        if h is not None or covariates is not None:
            raise InputError("The step and the covariates must be those of the data. Got others beside them.")
        return run_along(self.graph, dataset_of(u, output=False))

    def save(self, path: str | Path) -> None:
        """Write ``*.model.toml`` to `path`, atomically."""
        data: dict[str, Any] = {"format": FORMAT, "key": self.key, "text": self.text}
        if self.step is not None:
            data["step"] = float(self.step)
        tables = graph_tables(self.graph)
        blocks = tables.pop("blocks")  # last, long as they are
        data |= {**tables, "fit": self.fit, "provenance": self.provenance, "blocks": blocks}
        write_toml(path, data, f"HystFMU model '{self.key}': blocks in evaluation order.", _TIME)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read ``*.model.toml`` from `path`.

        Raises
        ------
        InputError
            One line with file, key, rule and value.
        """
        table = load_toml(path)
        check_format(table, FORMAT, path, required=True)
        f = check(table, _File, path)
        try:
            graph = f.graph()
        except InputError as e:
            raise InputError(f"{path}: {e}") from None
        return cls(f.key, graph, f.step, f.text, f.fit, f.provenance)


M = TypeVar("M", bound=Model)


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
