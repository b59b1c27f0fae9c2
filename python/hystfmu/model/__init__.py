"""Models and their simulation. A model is a graph of blocks with its provenance and the errors of its fit.

A model file has the name `*.model.toml`. The first input of a graph is the driving input u. All further inputs are
covariates, which are identified by their names.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from hystfmu.base import Array, InputError, check, check_format, checked, load_toml, write_toml
from hystfmu.data import Dataset
from hystfmu.data.reader.arrays import Columns, is_frame
from hystfmu.graph import Graph
from hystfmu.graph.tables import GraphTable, Positive, graph_tables

FORMAT = 1
"""Version of the format of model files. Files with another version raise an error."""
_TIME = re.compile(rb"^seconds = .*\n", re.MULTILINE)  # duration of the fit, which differs from run to run


class ModelTable(GraphTable):
    """Keys of a model file."""

    format: Literal[1]
    key: str
    text: str = ""
    step: Positive | None = None
    fit: dict[str, Any] = Field({})
    provenance: dict[str, Any] = Field({})


@checked
@dataclass(frozen=True)
class Model:
    """Graph of blocks, with the origin of its parameter values and the errors of its fit.

    Functions that change a model return a new object of the same class. The subclass `hystfmu.Model` adds the methods
    of the public interface.

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

        Row 0 is the output after initialisation with ``u[0]``. Row k is the output of the exported FMU after its input
        is set to u_k and ``doStep(t_{k-1}, h)`` is called.

        Parameters
        ----------
        u : array, shape (n,), Dataset or data frame
            Input. A data set also gives the step and the covariates, and each of its records starts from the initial
            state.
        h : float, optional
            Time between the rows of an array (s). The default is the step of the model, or 1 s if the model has no
            step.
        covariates : dict of str to array or float, optional
            Covariates for an array `u`, by name, shape (n,). A number is a constant covariate.

        Returns
        -------
        array, shape (n,)

        Raises
        ------
        InputError
            A value is not finite, a covariate is missing or unknown, or a block does not permit the step.

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
            raise InputError("The arguments h and covariates belong to an array. Got them with a data set.")
        return run_along(self.graph, dataset_of(u, output=False))

    def save(self, path: str | Path) -> None:
        """Write the model to the file `path`, named ``*.model.toml``. If writing fails, an old file stays unchanged."""
        data: dict[str, Any] = {"format": FORMAT, "key": self.key, "text": self.text}
        if self.step is not None:
            data["step"] = float(self.step)
        tables = graph_tables(self.graph)
        blocks = tables.pop("blocks")  # written last, because this table is long
        data |= {**tables, "fit": self.fit, "provenance": self.provenance, "blocks": blocks}
        write_toml(path, data, f"HystFMU model '{self.key}': blocks in evaluation order.", _TIME)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a model from the file `path`.

        Raises
        ------
        InputError
            The file is not a valid model file. The message names the file, the key, the rule, and the invalid value.
        """
        table = load_toml(path)
        check_format(table, FORMAT, path, required=True)
        f = check(table, ModelTable, path)
        try:
            graph = f.graph()
        except InputError as e:
            raise InputError(f"{path}: {e}") from None
        return cls(f.key, graph, f.step, f.text, f.fit, f.provenance)


M = TypeVar("M", bound=Model)


def beside(graph: Graph) -> tuple[str, ...]:
    """Return the names of the covariates of a graph, which are all inputs after the first."""
    return tuple(i.name for i in graph.inputs[1:])


def input_rows(graph: Graph, u: Array | Sequence[float], given: Mapping[str, ArrayLike] | None) -> Array:
    """Combine the driving input and the covariates into the array of inputs that a graph accepts.

    Parameters
    ----------
    graph : Graph
        Graph of a model.
    u : array, shape (n,) or (n, n_inputs)
        Driving input, or all inputs as columns.
    given : dict of str to array or float, optional
        Covariates by name, shape (n,). A number is a constant covariate.

    Returns
    -------
    array
        Shape (n,) for a graph with one input, otherwise (n, n_inputs).

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
    """Return the array of inputs of a graph, (n,) or (n, n_inputs), with all covariates at their start values."""
    return input_rows(graph, u, {i.name: i.start for i in graph.inputs[1:]})


def rows_of(graph: Graph, data: Dataset) -> Array:
    """Return the array of inputs of a graph from a data set: the input u and the covariates of the graph.

    Raises
    ------
    InputError
        The data have no covariate of this name, or its unit of measure differs from the unit in the graph.
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
    """Return the output of a graph, (n,) or (n, n_outputs), for records that each start from the initial state."""
    return data.along(lambda rows: graph.run(rows, data.h), inputs=rows_of(graph, data))


def rms(e: Array) -> float:
    """Return the root mean square of e (n,), in the unit of measure of e."""
    return float(np.sqrt(np.mean(e**2)))


def errors(y: Array, measured: Array, span: float) -> dict[str, float]:
    """Compute the RMS error and the largest absolute error, in the unit of measure of y and in percent of `span`.

    Parameters
    ----------
    y, measured : array, shape (n,)
        Output of the model, and the measured output.
    span : float
        Span of y that counts as 100 %, in the unit of measure of y.

    Returns
    -------
    dict of str to float
        ``rms``, ``max``, ``rms_percent``, ``max_percent``.
    """
    e = y - measured
    typical, most = rms(e), float(np.abs(e).max())
    return {"rms": typical, "max": most, "rms_percent": 100 * typical / span, "max_percent": 100 * most / span}
