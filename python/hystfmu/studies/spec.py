"""The file format of a study: a scenario, its cases, parameters with their ranges, and a sampling method."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import pydantic
from pydantic import Field

from hystfmu.base.errors import InputError
from hystfmu.base.files import read_toml
from hystfmu.graph.tables import STRICT, Name
from hystfmu.scenario import Scenario
from hystfmu.scenario.system.case import Case, split_end
from hystfmu.scenario.system.extends import MOST_BYTES

Finite = Annotated[float, Field(allow_inf_nan=False)]
MOST_ROWS = 10_000_000


class ParameterSpec(pydantic.BaseModel):
    """The values of one `unit.parameter`, given by exactly one of `range`, `scale` and `values`."""

    model_config = STRICT
    range: Annotated[list[Finite], Field(min_length=2, max_length=2)] | None = Field(
        None, description="lowest and highest value"
    )
    scale: Annotated[list[Finite], Field(min_length=2, max_length=2)] | None = Field(
        None, description="lowest and highest factor on the value in the scenario"
    )
    values: list[Finite] | None = Field(None, min_length=1, max_length=100_000, description="list of values")
    log: bool = Field(False, description="sample on a logarithmic scale")
    steps: int = Field(5, ge=1, le=100_000, description="grid: number of values in a range")

    @pydantic.model_validator(mode="after")
    def _one(self) -> ParameterSpec:
        given = [k for k in ("range", "scale", "values") if getattr(self, k) is not None]
        if len(given) != 1:
            raise ValueError(
                f"must have exactly one of range, scale, values. Got {', '.join(given) or 'none'} instead."
            )
        if self.values is None:
            lo, hi = self.bounds
            if not lo < hi:
                raise ValueError(f"a range must rise. Got {lo} to {hi} instead.")
            if self.log and lo <= 0:
                raise ValueError(f"a logarithmic range must be greater than 0. Got {lo} instead.")
        return self

    @property
    def bounds(self) -> tuple[float, float]:
        """Lowest and highest value of the range."""
        lo, hi = self.range if self.range is not None else self.scale or (0.0, 0.0)
        return lo, hi

    def at(self, fraction: float) -> float:
        """Map a fraction in [0, 1] to a value."""
        if self.values is not None:
            return self.values[min(int(fraction * len(self.values)), len(self.values) - 1)]
        lo, hi = self.bounds
        return float(lo * (hi / lo) ** fraction) if self.log else lo + (hi - lo) * fraction

    def setting(self, value: float) -> float | str:
        """Return the value in the form that `set` of a scenario takes."""
        return f"*{value!r}" if self.scale is not None else value


class LoopSpec(pydantic.BaseModel):
    """Limits of the linearised loop: peak of the sensitivity in one case, stability in the corners."""

    model_config = STRICT
    case: Name = Field(description="case whose sensitivity is limited, for slope 1 of plant over inverse")
    Ms_db: Annotated[float, Field(gt=0, le=60)] = Field(6.0, description="largest peak of the sensitivity (dB)")
    delay: Annotated[float, Field(ge=0, le=100)] = Field(0.0, description="steps beyond the delay of the case")
    corners: list[Name] = Field([], max_length=100, description="cases whose loops must be stable")
    slopes: Annotated[list[Finite], Field(min_length=2, max_length=2)] = Field(
        [1.0, 1.0], description="local slopes of plant over inverse, without the gain of the dynamics: corners"
    )
    delays: list[Annotated[float, Field(ge=0, le=100)]] = Field(
        [0.0], min_length=1, max_length=20, description="steps beyond the delay of the case: corners"
    )


class ObjectiveSpec(pydantic.BaseModel):
    """The objective that Optuna minimises."""

    model_config = STRICT
    metric: Name
    over_cases: Literal["max", "mean"] = Field("max", description="how the values of several cases are combined")
    targets: dict[str, Annotated[float, Field(gt=0, allow_inf_nan=False)]] = Field(
        {}, description="reference value of the metric by case, so that easy and hard cases count alike; 1 by default"
    )
    limits: dict[Name, Finite] = Field({}, description="upper limits of metrics, for every case")
    loop: LoopSpec | None = Field(None, description="limits of the linearised loop")

    def score(self, rows: Sequence[dict[str, Any]]) -> float:
        """Return the objective of a variation from its rows, one per case; NaN if a run failed."""
        values: list[float] = [
            row["metrics"].get(self.metric, math.nan) / self.targets.get(row["case"], 1.0) for row in rows
        ]
        if not all(map(math.isfinite, values)):
            return math.nan
        return max(values) if self.over_cases == "max" else sum(values) / len(values)


class StudySpec(pydantic.BaseModel):
    """The whole study file."""

    model_config = STRICT
    name: Name
    text: str = ""
    scenario: str = Field(description="folder of the scenario, relative to the study file")
    cases: list[str] | None = Field(None, min_length=1, description="cases of the scenario; all by default")
    engine: Literal["native", "fmpy"] = Field("native", description="engine of `hystfmu run`")
    method: Literal["grid", "sobol", "latin_hypercube", "optuna"]
    n: int = Field(64, ge=1, le=MOST_ROWS, description="number of variations; a grid has the product of its steps")
    seed: int = Field(0, ge=0, le=2**31 - 1)
    timeout: Annotated[float, Field(gt=0, le=1e6)] = Field(60.0, description="time limit of one run (s)")
    memory: Annotated[float, Field(gt=0, le=1e4)] = Field(4.0, description="memory limit of a worker (GB)")
    parameters: dict[str, ParameterSpec] = Field(min_length=1, max_length=1000)
    objective: ObjectiveSpec | None = None


class Study:
    """A study file with the cases of its scenario.

    Parameters
    ----------
    path : path
        Study file (`*.study.toml`).

    Raises
    ------
    InputError
        If the file or its scenario is invalid: one line with file, key, rule and value.
    """

    def __init__(self, path: str | Path) -> None:
        self.file = Path(path)
        self.spec = read_toml(self.file, StudySpec, MOST_BYTES)
        scenario = Scenario(self.file.parent / self.spec.scenario)
        have = {c.name: c for c in scenario.cases}
        names = self.spec.cases if self.spec.cases is not None else list(have)
        for name in names:
            if name not in have:
                raise InputError(f"{self.file}: cases: no case {name!r}; there are {', '.join(have)}")
        self.cases: tuple[Case, ...] = tuple(have[n] for n in names)
        for key in self.spec.parameters:
            split_end(key, f"{self.file}: parameters")
        if (self.spec.method == "optuna") != (self.spec.objective is not None):
            raise InputError(
                f"{self.file}: objective: must be given for the method 'optuna' only. Got {self.spec.method!r} instead."
            )
        if self.spec.objective is not None:
            metrics = scenario.spec.metrics
            for name in [self.spec.objective.metric, *self.spec.objective.limits]:
                if name not in metrics:
                    raise InputError(f"{self.file}: objective: no metric {name!r}; there are {', '.join(metrics)}")
            for name in self.spec.objective.targets:
                if name not in names:
                    raise InputError(f"{self.file}: objective.targets: no case {name!r}; there are {', '.join(names)}")
            loop = self.spec.objective.loop
            for name in (loop.case, *loop.corners) if loop else ():
                if name not in have:
                    raise InputError(f"{self.file}: objective.loop: no case {name!r}; there are {', '.join(have)}")
        self.scenario_cases = have

    @property
    def parameters(self) -> dict[str, ParameterSpec]:
        """Parameters by `unit.parameter`."""
        return self.spec.parameters

    def settings(self, values: dict[str, float]) -> dict[str, Any]:
        """Return the values of a variation, by parameter, in the form that `set` of a scenario takes."""
        return {k: self.parameters[k].setting(v) for k, v in values.items()}
