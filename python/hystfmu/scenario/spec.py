"""What a `scenario.toml` may say: units, connections, order, step, cases, metrics with limits; checked first.

A file is read in two stages.  The pydantic models below check keys, types and ranges; `Scenario.cases` then puts the
overrides of every `[[case]]` on top of the scenario, so that the rest of the program sees plain, complete cases.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import pydantic
from pydantic import Field

from hystfmu.errors import InputError
from hystfmu.files import read_toml
from hystfmu.graph_table import STRICT, GraphTable, Name, Number, Value

MOST_BYTES = 2**20  # of a scenario.toml
MOST_STEPS = 20_000_000  # of the finest unit in one case
NAME = r"[A-Za-z][A-Za-z0-9_]*"
_END = re.compile(rf"({NAME})\.({NAME})\Z")

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class UnitSpec(pydantic.BaseModel):
    """One unit: what it is (exactly one of `model`, `block`, `graph`, `inverse_of`, `fmu`), how it runs, how often."""

    model_config = STRICT
    model: str | None = Field(None, description="path of a *.model.toml, relative to the scenario's folder")
    block: str | None = Field(None, description="key of a block; its sizes and values follow in `dims` and `values`")
    dims: dict[str, int] = Field({}, description="sizes of `block`")
    values: dict[str, Value] = Field({}, description="parameter values of `block`")
    fmu: str | None = Field(None, description="path of an FMU of any origin, relative to the scenario's folder")
    graph: GraphTable | None = Field(None, description="blocks, wires, inputs, outputs, as in a model file")
    inverse_of: str | None = Field(None, description="path of a *.model.toml whose exact inverse runs")
    runs_as: Literal["fmu2", "fmu3", "python"] = Field(
        "fmu2", alias="as", description="FMI 2.0, FMI 3.0 or Python unit"
    )
    every: int = Field(1, ge=1, le=1_000_000, description="runs once in so many steps")
    fine: bool = Field(False, description="runs `ripple` times per step: plants and what is measured between samples")
    substeps: int = Field(1, ge=1, le=10_000, description="steps of the unit in each of its periods")
    hold: Literal["zero", "first"] = Field(
        "zero",
        description="its connected inputs during a period: held, or on the straight line through the last two values",
    )
    inputs: dict[str, Number] = Field({}, description="constant values of inputs that nothing is connected to")
    set: dict[str, Value] = Field({}, description="parameter overrides; a string '*1.2' scales the value")
    text: str = Field("", description="one line for a reader")

    @pydantic.model_validator(mode="after")
    def _one_source(self) -> UnitSpec:
        given = [k for k in ("model", "block", "graph", "inverse_of", "fmu") if getattr(self, k) is not None]
        if len(given) != 1:
            raise ValueError(f"a unit has exactly one of model, block, graph, inverse_of, fmu; here: {given or 'none'}")
        if self.block is None and (self.dims or self.values):
            raise ValueError("dims and values belong to 'block'; use 'set' to change a model's parameters")
        if self.fine and self.every != 1:
            raise ValueError("a unit is either fine or slow: 'fine' and 'every' exclude each other")
        return self


class MetricSpec(pydantic.BaseModel):
    """A number computed from signals, and the limit that it must not exceed."""

    model_config = STRICT
    kind: Literal[
        "rms_percent", "max_percent", "between_samples_percent", "variation_ratio", "peak", "final", "loop_area_percent"
    ] = Field(description="what is computed: see hystfmu.scenario.metrics")
    signal: str = Field(description="unit.output")
    against: str | None = Field(None, description="unit.output that the signal is compared with")
    stroke: Positive | None = Field(None, description="what 100 percent is; default: span of `against` in the window")
    after: Annotated[float, Field(ge=0, allow_inf_nan=False)] = Field(0.0, description="rows at or after this time (s)")
    limit: Annotated[float, Field(ge=0, allow_inf_nan=False)] | None = Field(
        None, description="largest value that is good; may be set per case"
    )
    text: str = Field("", description="one line for a reader")


Scheme = Literal["gauss_seidel", "jacobi", "iterative"]


class CouplingSpec(pydantic.BaseModel):
    """How units that step at the same time exchange values."""

    model_config = STRICT
    scheme: Scheme = Field(
        "gauss_seidel",
        description="gauss_seidel: in the stated order, with the newest values; jacobi: all with the values of the "
        "last step; iterative: sweeps from the same saved states until what was read early agrees with what came out",
    )
    events: Literal["hit", "grid"] = Field(
        "hit",
        description="jumps, corners and reversals of references between two steps; hit: the step is cut there, for "
        "units that run at the finest rate and have no sampled block; grid: they take effect at the next step",
    )
    tolerance: Positive = Field(1e-12, description="iterative: largest disagreement, relative to 1 + |value|")
    most_sweeps: int = Field(50, ge=2, le=10_000, description="iterative: sweeps before the run is given up")


class TubeSpec(pydantic.BaseModel):
    """How far a recorded signal may lie from its baseline in time and value at once, instead of `tolerance`."""

    model_config = STRICT
    time: Annotated[float, Field(ge=0, allow_inf_nan=False)] = Field(0.0, description="early or late by as much (s)")
    value: Annotated[float, Field(ge=0, le=1)] = Field(description="of the largest value of the signal")


class CaseSpec(pydantic.BaseModel):
    """A variant: what differs from the scenario."""

    model_config = STRICT
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.\-]*$", max_length=64)]
    text: str = ""
    stop: Positive | None = Field(None, description="end of the run (s)")
    after: Annotated[float, Field(ge=0, allow_inf_nan=False)] | None = Field(None, description="`after` of all metrics")
    set: dict[str, Value] = Field({}, description="'unit.parameter' = value, or '*1.2' to scale it")
    units: dict[Name, UnitSpec] = Field({}, description="units that are added or replaced as a whole")
    order: list[Name] | None = Field(None, description="order of evaluation, when it differs")
    coupling: CouplingSpec | None = Field(None, description="coupling, when it differs")
    connections: dict[str, str] = Field({}, description="connections that are added or replaced")
    limits: dict[Name, Annotated[float, Field(ge=0, allow_inf_nan=False)]] = Field(
        {}, description="limits of metrics, by name"
    )


class ScenarioSpec(pydantic.BaseModel):
    """The whole file."""

    model_config = STRICT
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
    tube: TubeSpec | None = Field(None, description="room for recorded signals instead of `tolerance`")
    memory: bool = Field(False, description="the states of all units at the end must equal those of the baseline")
    case: list[CaseSpec] = Field([], max_length=200, description="variants; without any there is one, 'nominal'")


@dataclass(frozen=True)
class Case:
    """One variant with everything filled in."""

    scenario: str
    about: str
    name: str
    text: str
    folder: Path
    step: float
    stop: float
    ripple: int
    order: tuple[str, ...]
    coupling: CouplingSpec
    units: dict[str, UnitSpec]
    connections: dict[str, str]
    metrics: dict[str, MetricSpec]
    record: tuple[str, ...]
    loops: tuple[tuple[str, str], ...]
    delay: str
    tolerance: float
    overrides: dict[str, Any]
    """From the command line: apply where the unit and the parameter exist."""
    tube: TubeSpec | None = None
    memory: bool = False

    @property
    def title(self) -> str:
        """`scenario/case`, as error lines and reports name it."""
        return f"{self.scenario}/{self.name}"

    @property
    def file(self) -> Path:
        """The file that the case comes from."""
        return self.folder / "scenario.toml"


def split_end(end: str, where: str) -> tuple[str, str]:
    """`unit.variable` as its two names.

    Raises
    ------
    InputError
        With `where` (file and key) in front.
    """
    m = _END.match(end)
    if not m:
        raise InputError(f"{where}: must read 'unit.variable'; got {end!r}")
    return m[1], m[2]


class Scenario:
    """A `scenario.toml` and its cases.

    Parameters
    ----------
    path : path
        The file, or the folder that holds it.
    overrides : mapping of str to value
        ``{"unit.parameter": value}`` on top of everything else, in the cases that have such a parameter.
    coupling : str, optional
        Scheme that all cases take instead of their own.

    Raises
    ------
    InputError
        One line with the file, the key, the rule and the value.
    """

    def __init__(
        self, path: str | Path, overrides: dict[str, Any] | None = None, coupling: Scheme | None = None
    ) -> None:
        path = Path(path)
        self.file = path / "scenario.toml" if path.suffix != ".toml" else path
        self.folder = self.file.parent
        self.spec = read_toml(self.file, ScenarioSpec, MOST_BYTES)
        self.overrides = dict(overrides or {})
        self.coupling = coupling
        self.cases = self._cases()

    def _cases(self) -> tuple[Case, ...]:
        specs = self.spec.case or [CaseSpec.model_validate({"name": "nominal"})]
        names = [c.name for c in specs]
        for n in names:
            if names.count(n) > 1:
                raise InputError(f"{self.file}: case: two cases have the name {n!r}")
        return tuple(self._case(c) for c in specs)

    def _case(self, c: CaseSpec) -> Case:
        s, where = self.spec, f"{self.file}: case {c.name}"
        units = {**s.units, **c.units}
        for key, value in c.set.items():
            unit, parameter = split_end(key, f"{where}: set")
            if unit not in units:
                raise InputError(f"{where}: set: no unit {unit!r}; there are {sorted(units)}")
            merged = {**units[unit].set, parameter: value}
            units[unit] = units[unit].model_copy(update={"set": merged})
        coupling = c.coupling if c.coupling is not None else s.coupling
        if self.coupling is not None:
            coupling = coupling.model_copy(update={"scheme": self.coupling})
        metrics = {}
        for name in c.limits:
            if name not in s.metrics:
                raise InputError(f"{where}: limits: no metric {name!r}; there are {sorted(s.metrics)}")
        for name, m in s.metrics.items():
            update: dict[str, float] = {}
            if name in c.limits:
                update["limit"] = c.limits[name]
            if c.after is not None:
                update["after"] = c.after
            metrics[name] = m.model_copy(update=update)
        case = Case(
            scenario=s.name,
            about=s.text,
            name=c.name,
            text=c.text,
            folder=self.folder,
            step=s.step,
            stop=c.stop if c.stop is not None else s.stop,
            ripple=s.ripple,
            order=tuple(c.order if c.order is not None else s.order),
            coupling=coupling,
            units=units,
            connections={**s.connections, **c.connections},
            metrics=metrics,
            record=tuple(s.record),
            loops=tuple((a, b) for a, b in s.loops),
            delay=s.delay,
            tolerance=s.tolerance,
            tube=s.tube,
            memory=s.memory,
            overrides=self.overrides,
        )
        self._check(case, where)
        return case

    @staticmethod
    def _check(case: Case, where: str) -> None:
        """What can be said without opening a model: the order, the length of the run, the window of the metrics."""
        twice = {u for u in case.order if case.order.count(u) > 1}
        missing, unknown = set(case.units) - set(case.order), set(case.order) - set(case.units)
        if twice or missing or unknown:
            wrong = f"twice: {sorted(twice)}" if twice else f"missing: {sorted(missing)}, unknown: {sorted(unknown)}"
            raise InputError(f"{where}: order: must name every unit once; {wrong}")
        steps = case.stop / case.step
        if abs(steps - round(steps)) > 1e-6 * steps or steps < 1:
            raise InputError(f"{where}: stop: must be a multiple of the step {case.step:g} s; got {case.stop:g}")
        if steps * case.ripple > MOST_STEPS:
            raise InputError(f"{where}: stop: at most {MOST_STEPS} fine steps; got {steps * case.ripple:.0f}")
        for name, m in case.metrics.items():
            if m.after >= case.stop:
                raise InputError(f"{where}: metrics.{name}.after: must be below stop {case.stop:g} s; got {m.after:g}")


def inside(folder: Path, relative: str, where: str) -> Path:
    """A path of a scenario, which may not leave the folder of all scenarios (the parent of the scenario's own).

    Raises
    ------
    InputError
        Absolute path, or a path that leads out (also through a symbolic link).
    """
    if Path(relative).is_absolute() or "\\" in relative or ":" in relative:
        raise InputError(f"{where}: must be a path relative to the scenario, with '/'; got {relative!r}")
    root = folder.resolve().parent
    path = (folder.resolve() / relative).resolve()
    if not path.is_relative_to(root):
        raise InputError(f"{where}: must stay within the folder of the scenarios; got {relative!r}")
    return path
