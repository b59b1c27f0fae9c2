"""The keys of a `scenario.toml`: units, connections, order, step, cases, and metrics with limits.

These models check keys, types and ranges.  `hystfmu.scenario.system.case` makes complete cases of them.
"""

from __future__ import annotations

from typing import Annotated, Literal

import pydantic
from pydantic import Field

from hystfmu.graph.tables import STRICT, GraphTable, Name, Number, Value

FORMAT: Literal[1] = 1
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


SOURCES = {"model", "block", "graph", "inverse_of", "fmu"}  # keys that say what a unit is


class UnitSpec(pydantic.BaseModel):
    """One unit: content (exactly one of `model`, `block`, `graph`, `inverse_of`, `fmu`), and settings of the run."""

    model_config = STRICT
    model: str | None = Field(None, description="path of a *.model.toml, relative to the scenario's folder")
    block: str | None = Field(None, description="key of a block; its sizes and values follow in `dims` and `values`")
    dims: dict[str, int] = Field({}, description="sizes of `block`")
    values: dict[str, Value] = Field({}, description="parameter values of `block`")
    fmu: str | None = Field(None, description="path of a foreign FMU, relative to the scenario's folder")
    graph: GraphTable | None = Field(None, description="blocks, wires, inputs, outputs, as in a model file")
    inverse_of: str | None = Field(None, description="path of a *.model.toml whose exact inverse runs")
    runs_as: Literal["fmu2", "fmu3"] = Field("fmu2", alias="as", description="version of FMI, for the engine fmpy")
    every: int = Field(1, ge=1, le=1_000_000, description="number of steps in a period of the unit")
    fine: bool = Field(False, description="runs `ripple` times per step: plants and what is measured between samples")
    substeps: int = Field(1, ge=1, le=10_000, description="steps of the unit in each of its periods")
    hold: Literal["zero", "first"] = Field(
        "zero",
        description="connected inputs during a period: held, or on the line through the last two values",
    )
    inputs: dict[str, Number] = Field({}, description="constant values of inputs that nothing is connected to")
    set: dict[str, Value] = Field({}, description="parameter overrides; a string '*1.2' scales the value")
    text: str = Field("", description="one line for a reader")

    @pydantic.model_validator(mode="after")
    def _one_source(self) -> UnitSpec:
        given = sorted(k for k in SOURCES if getattr(self, k) is not None)
        if len(given) != 1:
            raise ValueError(f"a unit has exactly one of model, block, graph, inverse_of, fmu; here: {given or 'none'}")
        if self.block is None and (self.dims or self.values):
            raise ValueError("dims and values belong to 'block'; use 'set' to change a model's parameters")
        if self.fine and self.every != 1:
            raise ValueError("a unit is either fine or slow: 'fine' and 'every' exclude each other")
        return self


MetricKind = Literal[
    "rms_percent",
    "max_percent",
    "between_samples_percent",
    "variation_ratio",
    "rms",
    "peak",
    "final",
    "loop_area_percent",
]


class MetricSpec(pydantic.BaseModel):
    """A number computed from signals, and the limit that it must not exceed."""

    model_config = STRICT
    kind: MetricKind = Field(description="what is computed: see hystfmu.scenario.outcome.metrics")
    signal: str = Field(description="unit.output")
    against: str | None = Field(None, description="unit.output that the signal is compared with")
    stroke: Positive | None = Field(None, description="what 100 percent is; default: span of `against` in the window")
    after: Annotated[float, Field(ge=0, allow_inf_nan=False)] = Field(0.0, description="rows at or after this time (s)")
    lines: bool = Field(False, description="rms_percent, rms and max_percent: scan lines only, without turn-arounds")
    limit: Annotated[float, Field(ge=0, allow_inf_nan=False)] | None = Field(
        None, description="largest value that is good; may be set per case"
    )
    text: str = Field("", description="one line for a reader")

    @pydantic.model_validator(mode="after")
    def _partner(self) -> MetricSpec:
        if self.kind not in ("peak", "final") and self.against is None:
            raise ValueError(f"{self.kind} needs 'against'")
        if self.lines and self.kind not in ("rms_percent", "rms", "max_percent"):
            raise ValueError(f"'lines' belongs to rms_percent, rms and max_percent. Got {self.kind} instead.")
        return self


Scheme = Literal["gauss_seidel", "jacobi", "iterative"]


class CouplingSpec(pydantic.BaseModel):
    """Exchange of values between units that step at the same time."""

    model_config = STRICT
    scheme: Scheme = Field(
        "gauss_seidel",
        description="gauss_seidel: in the stated order, with the newest values; jacobi: all with the values of the "
        "last step; iterative: sweeps from the same saved states until values read early agree with the outputs, "
        "by Newton's method if all units in loops have tangents",
    )
    events: Literal["located", "grid"] = Field(
        "located",
        description="discontinuities, kinks and reversals of references between two communication points; located: a "
        "step ends on each, for units that run at the finest rate and have no sampled block; grid: they take effect at "
        "the next step",
    )
    tolerance: Positive = Field(1e-12, description="iterative: largest disagreement, relative to 1 + |value|")
    max_sweeps: int = Field(50, ge=2, le=10_000, description="iterative: sweeps in a step before the run stops")


class TubeSpec(pydantic.BaseModel):
    """Tolerance of a recorded signal in time and value at once, instead of `tolerance`."""

    model_config = STRICT
    time: Annotated[float, Field(ge=0, allow_inf_nan=False)] = Field(0.0, description="largest shift in time (s)")
    value: Annotated[float, Field(ge=0, le=1)] = Field(
        description="largest deviation, relative to the largest value of the signal"
    )


class MarginsSpec(pydantic.BaseModel):
    """Limits of the linearised loop, in addition to the limits of metrics."""

    model_config = STRICT
    case: Name | None = Field(
        None, description="case whose sensitivity is limited, for slope 1 of plant over inverse; default: the first"
    )
    Ms_db: Annotated[float, Field(gt=0, le=60)] | None = Field(None, description="largest peak of its sensitivity (dB)")
    corners: list[Annotated[str, Field(pattern=r"^[A-Za-z0-9_.\-?*]+$", max_length=64)]] = Field(
        ["*"], max_length=100, description="cases whose loops must be stable; ? and * stand for any letters"
    )
    slopes: Annotated[list[Annotated[float, Field(allow_inf_nan=False)]], Field(min_length=2, max_length=2)] | None = (
        Field(None, description="local slopes of plant over inverse in the corners; default: those along their paths")
    )
    stable_to_steps: Annotated[float, Field(ge=0, le=100)] | None = Field(
        None, description="steps beyond the delay of a corner up to which it must be stable"
    )
    expected_unstable: list[Name] = Field(
        [],
        max_length=100,
        description="cases whose linear loop is unstable for a slope of their path and whose run holds; any other such "
        "case fails",
    )


class ConditionSpec(pydantic.BaseModel):
    """Keys in which a case may differ from the scenario."""

    model_config = STRICT
    text: str = Field("", description="one line for a reader")
    stop: Positive | None = Field(None, description="end of the run (s)")
    after: Annotated[float, Field(ge=0, allow_inf_nan=False)] | None = Field(None, description="`after` of all metrics")
    set: dict[str, Value] = Field({}, description="'unit.parameter' = value, or '*1.2' to scale it")
    units: dict[Name, UnitSpec] = Field({}, description="units that are added or replaced as a whole")
    order: list[Name] | None = Field(
        None, description="order of evaluation; default: as in the scenario, then the units that the case adds"
    )
    connections: dict[str, str] = Field({}, description="connections that are added or replaced")
    limits: dict[Name, Annotated[float, Field(ge=0, allow_inf_nan=False)]] = Field(
        {}, description="limits of metrics, by name"
    )


class CaseSpec(ConditionSpec):
    """A case: the differences from the scenario."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.\-]*$", max_length=64)]
    conditions: list[Name] = Field([], description="conditions of the scenario that the case takes; later ones win")
    coupling: CouplingSpec | None = Field(None, description="coupling, when it differs")


class ScenarioSpec(pydantic.BaseModel):
    """Content of a scenario.toml."""

    model_config = STRICT
    format: Literal[1] = Field(FORMAT, description="version of the keys; others are refused")
    name: Name
    text: str = ""
    delay: str = Field("", description="a note on delays in the loop, printed beside the computed delay budget")
    step: Positive = Field(description="step of the units (s)")
    stop: Positive = Field(description="end of the run (s)")
    ripple: int = Field(1, ge=1, le=1000, description="steps of the fine units per step; the command is held meanwhile")
    order: list[Name] = Field(
        min_length=1, max_length=200, description="Gauss-Seidel order: every unit reads the newest values there are"
    )
    coupling: CouplingSpec = Field(CouplingSpec.model_validate({}), description="how units exchange values")
    units: dict[Name, UnitSpec] = Field(min_length=1, max_length=200)
    connections: dict[str, str] = Field({}, description="'unit.input' = 'unit.output'")
    record: list[str] = Field([], description="outputs stored in baseline.csv and shown in the report")
    loops: list[Annotated[list[str], Field(min_length=2, max_length=2)]] = Field(
        [], description="pairs of signals (abscissa, ordinate) drawn as loops"
    )
    metrics: dict[Name, MetricSpec] = Field(min_length=1, max_length=100)
    tolerance: Annotated[float, Field(ge=0, le=1)] = Field(
        1e-6, description="largest change of a metric or a recorded signal against the baseline, relative"
    )
    guard: Annotated[float, Field(ge=1, allow_inf_nan=False)] | None = Field(
        None, description="largest multiple of its recorded value that a metric may reach, beside its limit"
    )
    tube: TubeSpec | None = Field(None, description="room for recorded signals instead of `tolerance`")
    final_states: bool = Field(False, description="the final states of all units must have the bits of the baseline")
    conditions: dict[Name, ConditionSpec] = Field({}, description="stated once, for the cases that name them")
    margins: MarginsSpec | None = Field(None, description="limits of the linearised loop: see hystfmu margins")
    case: list[CaseSpec] = Field([], max_length=200, description="variants; without any there is one, 'nominal'")
