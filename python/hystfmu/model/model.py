"""A model: a graph of blocks with values, provenance and errors of the fit; stored as `*.model.toml`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from numpy.typing import ArrayLike
from pydantic import Field

from hystfmu.base.arrays import Array
from hystfmu.base.calls import checked
from hystfmu.base.errors import InputError
from hystfmu.base.files import check, check_format, load_toml, write_toml
from hystfmu.graph import Graph
from hystfmu.graph.tables import GraphTable, graph_tables
from hystfmu.model.inputs import input_rows

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
    """A graph with provenance: the object that `fit`, `inverse`, `export` and scenarios pass on.

    Parameters
    ----------
    key : str
        Kind of model, e.g. ``"zhao_tan_mlp"``.
    graph : Graph
        Blocks in evaluation order, with all values (normalisation included).
    step : float or None
        Sample step of the identification (s); None if the model has none.
    text : str
        Description, one line.
    fit : dict
        Results of the identification, e.g. ``{"rms_percent": 0.7, "parameters": 49}``.
    provenance : dict
        Data file, rows, options, versions.
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
        u: Array | Sequence[float],
        h: float | None = None,
        covariates: Mapping[str, ArrayLike] | None = None,
    ) -> Array:
        """Run the model free from a fresh start.

        Row 0 is the output after initialisation with ``u[0]``. Row k is the output of an FMU after the calls set u_k,
        doStep(t_{k-1}, h), get y.

        Parameters
        ----------
        u : array, shape (n,)
            Input.
        h : float, optional
            Step (s); default the step of the model, else 1 s.
        covariates : dict of str to array or float, optional
            Further inputs that the model takes, by name, shape (n,); a number is held.

        Returns
        -------
        array, shape (n,)

        Raises
        ------
        InputError
            A value is not finite, a covariate is missing or unknown, or the core refuses the step.
        """
        rows = input_rows(self.graph, u, covariates)
        return self.graph.run(rows, h if h is not None else self.step if self.step is not None else 1.0)

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
