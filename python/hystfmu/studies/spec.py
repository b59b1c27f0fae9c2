"""What a `study.toml` may say: a scenario, its cases, parameters with their ranges, and how they are sampled."""

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
from hystfmu.scenario.system.case import MOST_BYTES, Case, split_end

Finite = Annotated[float, Field(allow_inf_nan=False)]
MOST_ROWS = 10_000_000


class ParameterSpec(pydantic.BaseModel):
    """The values that one `unit.parameter` takes: exactly one of `range`, `scale`, `values`."""

    model_config = STRICT
    range: Annotated[list[Finite], Field(min_length=2, max_length=2)] | None = Field(None, description="from, to")
    scale: Annotated[list[Finite], Field(min_length=2, max_length=2)] | None = Field(
        None, description="factors on what the scenario says: from, to"
    )
    values: list[Finite] | None = Field(None, min_length=1, max_length=100_000, description="a list of values")
    log: bool = Field(False, description="ratios count, not differences")
    steps: int = Field(5, ge=1, le=100_000, description="grid: how many values of a range")

    @pydantic.model_validator(mode="after")
    def _one(self) -> ParameterSpec:
        given = [k for k in ("range", "scale", "values") if getattr(self, k) is not None]
        if len(given) != 1:
            raise ValueError(f"exactly one of range, scale, values; here: {given or 'none'}")
        if self.values is None:
            lo, hi = self.bounds
            if not lo < hi:
                raise ValueError(f"the range must rise; here {lo} to {hi}")
            if self.log and lo <= 0:
                raise ValueError(f"a range by ratios must be greater than 0; here from {lo}")
        return self

    @property
    def bounds(self) -> tuple[float, float]:
        """The lowest and the highest value of a range."""
        lo, hi = self.range if self.range is not None else self.scale or (0.0, 0.0)
        return lo, hi

    def at(self, fraction: float) -> float:
        """The value at a place of the unit interval."""
        if self.values is not None:
            return self.values[min(int(fraction * len(self.values)), len(self.values) - 1)]
        lo, hi = self.bounds
        return float(lo * (hi / lo) ** fraction) if self.log else lo + (hi - lo) * fraction

    def setting(self, value: float) -> float | str:
        """The value as a scenario's `set` takes it."""
        return f"*{value!r}" if self.scale is not None else value


class ObjectiveSpec(pydantic.BaseModel):
    """What Optuna makes small."""

    model_config = STRICT
    metric: Name
    over_cases: Literal["max", "mean"] = Field("max", description="how the cases of a variation make one number")
    targets: dict[str, Annotated[float, Field(gt=0, allow_inf_nan=False)]] = Field(
        {}, description="by case: what 1 is, so that easy and hard cases count alike; 1 by default"
    )
    limits: dict[Name, Finite] = Field({}, description="metrics that no case may exceed")

    def score(self, rows: Sequence[dict[str, Any]]) -> float:
        """What the rows of a variation, one per case, make of the objective; NaN where a run failed."""
        values: list[float] = [
            row["metrics"].get(self.metric, math.nan) / self.targets.get(row["case"], 1.0) for row in rows
        ]
        if not all(map(math.isfinite, values)):
            return math.nan
        return max(values) if self.over_cases == "max" else sum(values) / len(values)


class StudySpec(pydantic.BaseModel):
    """The whole file."""

    model_config = STRICT
    name: Name
    text: str = ""
    scenario: str = Field(description="folder of the scenario, relative to the study")
    cases: list[str] | None = Field(None, min_length=1, description="cases of the scenario; all by default")
    engine: Literal["native", "python", "fmpy"] = Field("native", description="as in `hystfmu run`")
    method: Literal["grid", "sobol", "latin_hypercube", "optuna"]
    n: int = Field(64, ge=1, le=MOST_ROWS, description="variations; a grid has the product of its steps")
    seed: int = Field(0, ge=0, le=2**31 - 1)
    timeout: Annotated[float, Field(gt=0, le=1e6)] = Field(60.0, description="longest time for one run (s)")
    memory: Annotated[float, Field(gt=0, le=1e4)] = Field(4.0, description="largest memory of a worker (GB)")
    parameters: dict[str, ParameterSpec] = Field(min_length=1, max_length=1000)
    objective: ObjectiveSpec | None = None


class Study:
    """A `study.toml` with the cases of its scenario.

    Parameters
    ----------
    path : path
        The file.

    Raises
    ------
    InputError
        One line with the file, the key, the rule and the value.
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
                f"{self.file}: objective: belongs to method 'optuna'; here the method is {self.spec.method!r}"
            )
        if self.spec.objective is not None:
            metrics = scenario.spec.metrics
            for name in [self.spec.objective.metric, *self.spec.objective.limits]:
                if name not in metrics:
                    raise InputError(f"{self.file}: objective: no metric {name!r}; there are {', '.join(metrics)}")
            for name in self.spec.objective.targets:
                if name not in names:
                    raise InputError(f"{self.file}: objective.targets: no case {name!r}; there are {', '.join(names)}")

    @property
    def parameters(self) -> dict[str, ParameterSpec]:
        """By `unit.parameter`."""
        return self.spec.parameters

    def settings(self, values: dict[str, float]) -> dict[str, Any]:
        """The `values` of a variation, by parameter, as a scenario's `set` takes them."""
        return {k: self.parameters[k].setting(v) for k, v in values.items()}
