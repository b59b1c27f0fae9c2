"""File format of a study: a scenario, its cases, parameters with their ranges, and a sampling method.

A study may contain a design that computes parameters of the scenario. The study then varies the requirements of the
design instead of each filter tap or pole. The design is computed for the values of each variation, and the result is
set in every case. The result is that of the function in `hy.design`.
"""

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, NoReturn

import numpy as np
import pydantic
from pydantic import Field

from hystfmu.base import Array, InputError, check, load_toml
from hystfmu.design.linear import python_control
from hystfmu.design.repetitive import filter_angles, learning_filters
from hystfmu.design.structures import loop_shaping
from hystfmu.graph.tables import STRICT, Bounds, Name, Number, Positive
from hystfmu.scenario import Cases, build
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.scenario.system.case import Case, split_end
from hystfmu.scenario.system.spec import MOST_BYTES, MOST_FILES, Decibels, Delay, inside

PREFIX = "design."
"""Prefix of parameters that only the design reads."""


class LearntLoops(pydantic.BaseModel):
    """Loops of one case for which the filters of a repetitive controller are designed."""

    model_config = STRICT
    case: Name
    set: dict[str, str | float | list[Number]] = Field({}, description="additional settings, as `set` of a scenario")
    slopes: list[Number] = Field([1.0], min_length=1, max_length=20, description="incremental gains")


class RepetitiveDesign(pydantic.BaseModel):
    """Design of the filters of a unit `repetitive` for several loops.

    A study varies the cutoff `design.cutoff` (Hz) and the gain `design.gain`.
    """

    model_config = STRICT
    method: Literal["repetitive_filters"]
    unit: Name = Field(description="unit of the block `repetitive`, whose taps are set")
    loops: list[LearntLoops] = Field(min_length=1, max_length=50)
    _learnt: list[Any] = pydantic.PrivateAttr([])  # responses of the loops, which do not depend on the varied values

    @property
    def reads(self) -> tuple[str, ...]:
        """Names of the parameters that the design uses."""
        return f"{PREFIX}cutoff", f"{PREFIX}gain"

    @property
    def cases(self) -> tuple[str, ...]:
        """Names of the cases that the design linearises."""
        return tuple(loop.case for loop in self.loops)

    def settings(self, cases: Mapping[str, Case], values: Mapping[str, float]) -> dict[str, Any]:
        """Design the filters for `values` of the parameters, and return their taps as the key `set` of a case."""
        for spec in self.loops if not self._learnt else ():
            case = cases[spec.case]
            opened = open_loop(build(replace(case, overrides={**case.overrides, **spec.set})), (1.0, 1.0))
            self._learnt += [opened.learnt(filter_angles(), slope) for slope in spec.slopes]
        dims, h = cases[self.loops[0].case].units[self.unit].dims, cases[self.loops[0].case].step
        cutoff, gain = (values[k] for k in self.reads)
        found = learning_filters(np.array(self._learnt), h, cutoff, gain, dims["n_q"], dims["n_l"])
        return {f"{self.unit}.q": found.q.tolist(), f"{self.unit}.l": found.l.tolist()}


class Weight(pydantic.BaseModel):
    """Weight W = K (1 + K_1 / s) (1 + K_2 / s) (T_z s + 1) / (T_p s + 1) with varied parameters.

    Each field is the name of a varied parameter of the study. If `Ki` is given instead of `K`, Ki / s replaces K.
    """

    model_config = STRICT
    K: str | None = None
    Ki: str | None = None
    K_1: str | None = None
    K_2: str | None = None
    T_z: str | None = None
    T_p: str | None = None

    @pydantic.model_validator(mode="after")
    def _one_gain(self) -> "Weight":
        if (self.K is None) == (self.Ki is None):
            raise ValueError("must have exactly one of K and Ki.")
        return self

    def transfer(self, values: Mapping[str, float]) -> Any:
        """Return the transfer function of the weight for the values of a variation."""
        control = python_control()
        drawn = {k: values[name] for k, name in self.model_dump(exclude_none=True).items()}
        W = control.tf([drawn.get("K", drawn.get("Ki"))], [1.0] if self.Ki is None else [1.0, 0.0])
        for k in ("K_1", "K_2"):
            if k in drawn:
                W *= control.tf([1.0, drawn[k]], [1.0, 0.0])
        return W * control.tf([drawn.get("T_z", 0.0), 1.0], [drawn.get("T_p", 0.0), 1.0])


class LoopShapingDesign(pydantic.BaseModel):
    """Design of the most robust controller by H-infinity loop shaping, for a weight with varied parameters.

    The result is a set of transfer functions in parallel.
    """

    model_config = STRICT
    method: Literal["loop_shaping"]
    case: Name = Field(description="case of the nominal plant; its delay is given by `delay`")
    delay: Delay = Field(description="steps of delay and hold, as a Pade approximant")
    order: int = Field(2, ge=1, le=6, description="of the approximant")
    ratio: Annotated[float, Field(gt=1, le=10)] = Field(
        1.1, description="optimal margin divided by the margin of the design"
    )
    weight: Weight
    robust: list[str] = Field(
        min_length=1, max_length=2, description="transfer functions `unit.block`: slow poles, then fast ones"
    )

    @property
    def reads(self) -> tuple[str, ...]:
        """Names of the parameters that the design uses."""
        return tuple(self.weight.model_dump(exclude_none=True).values())

    @property
    def cases(self) -> tuple[str, ...]:
        """Names of the cases that the design linearises."""
        return (self.case,)

    def settings(self, cases: Mapping[str, Case], values: Mapping[str, float]) -> dict[str, Any]:
        """Design the controller for `values` of the parameters.

        Return the coefficients of its transfer functions as the key `set` of a case.
        """
        control = python_control()
        opened = open_loop(build(cases[self.case]), (1.0, 1.0))
        G = control.ss(*opened.plant) * control.ss(control.tf(*control.pade(self.delay * opened.h, self.order)))
        robust = loop_shaping(G, self.weight.transfer(values), self.ratio).robust
        n = len(robust.A)
        sizes = [n] if len(self.robust) == 1 else [n // 2, n - n // 2]
        parts = in_parallel(robust.A, robust.B, robust.C, sizes)
        found: dict[str, Any] = {}
        for name, (b, a) in zip(self.robust, parts, strict=True):
            found |= {f"{name}_b": b.tolist(), f"{name}_a": a.tolist()}
        return found


def in_parallel(A: Array, B: Array, C: Array, sizes: list[int]) -> list[tuple[Array, Array]]:
    """Split a strictly proper system with simple poles into parallel transfer functions, slow poles first.

    A, B, C have the shapes (n, n), (n, 1), (1, n). `sizes` contains the number of poles of each part, and the sum of
    these numbers is n. Return the numerator and the denominator of each part. For a part with k poles, the shapes are
    (k,) and (k + 1,). The constant coefficient of the denominator is 1.
    """
    poles, V = np.linalg.eig(A)
    residues = (C @ V).ravel() * np.linalg.solve(V, B.astype(complex)).ravel()
    groups = _pairs(poles)
    if len(sizes) == 1:
        chosen = [list(range(len(poles)))]
    else:  # conjugate pairs stay together; of all subsets with this size, take the one whose fastest pole is slowest
        subsets = (s for k in range(len(groups) + 1) for s in itertools.combinations(groups, k))
        flat = [[i for g in s for i in g] for s in subsets]
        slow = min((s for s in flat if len(s) == sizes[0]), key=lambda s: sorted(np.abs(poles[s]))[::-1])
        chosen = [slow, [i for i in range(len(poles)) if i not in slow]]
    parts = []
    for part in chosen:
        a = np.poly(poles[part]).real
        b = sum(residues[i] * np.poly(poles[[j for j in part if j != i]]) for i in part)
        parts.append((np.real(b) / a[-1], a / a[-1]))
    return parts


def _pairs(poles: Array) -> list[list[int]]:
    """Return groups of indices: one index for a real pole, two indices for a conjugate pair.

    The poles are the eigenvalues of a real matrix. LAPACK returns a conjugate pair in sequence, first the pole with the
    positive imaginary part.
    """
    turns = [p.imag / abs(p) if abs(p) > 0 else 0.0 for p in poles]
    return [[i] if abs(turn) <= 1e-12 else [i, i + 1] for i, turn in enumerate(turns) if turn >= -1e-12]


Design = Annotated[RepetitiveDesign | LoopShapingDesign, Field(discriminator="method")]


MOST_ROWS = 10_000_000
LOOP_METRICS = ("Ms_db", "radius")  # metrics of the linearised loop, computed if the study has limits of the margins


class SecondOrderSpec(pydantic.BaseModel):
    """Ranges of second-order dynamics G(s) = gain w^2 / (s^2 + 2 zeta w s + w^2), w = 2 pi f_n, of one block."""

    model_config = STRICT
    gain: Bounds = Field(description="lowest and highest static gain")
    f_n: Bounds = Field(description="lowest and highest natural frequency (Hz)")
    zeta: Bounds = Field(description="lowest and highest damping ratio")

    @pydantic.model_validator(mode="after")
    def _physical(self) -> "SecondOrderSpec":
        for key in ("gain", "f_n", "zeta"):
            lo, hi = getattr(self, key)
            if not 0 < lo < hi:
                raise ValueError(f"{key} must rise from a value greater than 0. Got {lo} to {hi} instead.")
        return self

    @property
    def coordinates(self) -> "dict[str, ParameterSpec]":
        """Varied parameters by name."""
        return {k: ParameterSpec.model_validate({"range": getattr(self, k)}) for k in ("gain", "f_n", "zeta")}

    @staticmethod
    def settings(block: str, gain: float, f_n: float, zeta: float) -> dict[str, list[float]]:
        """Return the coefficients of the transfer function of `block`, as ``"unit.block"``."""
        w = 2 * math.pi * f_n
        return {f"{block}_b": [gain * w * w], f"{block}_a": [1.0, 2 * zeta * w, w * w]}


class ParameterSpec(pydantic.BaseModel):
    """Values of one `unit.parameter`. Exactly one of `range`, `scale`, `values` and `second_order` is given."""

    model_config = STRICT
    range: Bounds | None = Field(None, description="lowest and highest value")
    scale: Bounds | None = Field(None, description="lowest and highest factor on the value in the scenario")
    values: list[Number] | None = Field(None, min_length=1, max_length=100_000, description="list of values")
    second_order: SecondOrderSpec | None = Field(
        None, description="gain, f_n and zeta of the transfer function `unit.block`; its b and a are computed from them"
    )
    log: bool = Field(False, description="sample on a logarithmic scale")
    steps: int = Field(5, ge=1, le=100_000, description="grid: number of values in a range")

    @pydantic.model_validator(mode="after")
    def _one(self) -> "ParameterSpec":
        ways = ("range", "scale", "values", "second_order")
        given = [k for k in ways if getattr(self, k) is not None]
        if len(given) != 1:
            raise ValueError(f"must have exactly one of {', '.join(ways)}. Got {', '.join(given) or 'none'} instead.")
        if self.values is None and self.second_order is None:
            lo, hi = self.bounds
            if not lo < hi:
                raise ValueError(f"a range must rise. Got {lo} to {hi} instead.")
            if self.log and lo <= 0:
                raise ValueError(f"a logarithmic range must be greater than 0. Got {lo} instead.")
        return self

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest value of the range."""
        lo, hi = self.range if self.range is not None else self.scale or (0.0, 0.0)
        return lo, hi

    def at(self, fraction: float) -> float:
        """Return the value at the position `fraction` in the range, 0 to 1."""
        if self.values is not None:
            return self.values[min(int(fraction * len(self.values)), len(self.values) - 1)]
        lo, hi = self.bounds
        return float(lo * (hi / lo) ** fraction) if self.log else lo + (hi - lo) * fraction

    def fraction(self, value: float) -> float:
        """Return the position of a value in the range, 0 to 1. Positions of random values are uniformly distributed."""
        if self.values is not None:
            span = max(self.values) - min(self.values)
            return (value - min(self.values)) / span if span else 0.0
        lo, hi = self.bounds
        return math.log(value / lo) / math.log(hi / lo) if self.log else (value - lo) / (hi - lo)

    def coordinates(self, name: str) -> "dict[str, ParameterSpec]":
        """Return the independently varied quantities of the parameter `name`, by name.

        This is the parameter itself, or the quantities from which the parameter is computed.
        """
        if self.second_order is None:
            return {name: self}
        given = {"log": self.log, "steps": self.steps}
        return {f"{name}.{k}": p.model_copy(update=given) for k, p in self.second_order.coordinates.items()}

    def setting(self, value: float) -> float | str:
        """Return the value as an entry of the key `set` of a case."""
        return f"*{value!r}" if self.scale is not None else value


class LoopSpec(pydantic.BaseModel):
    """Limits of the linearised loop: peak of the sensitivity in one case, stability for worst-case parameter sets."""

    model_config = STRICT
    case: Name = Field(description="case whose sensitivity is limited, for an incremental gain of 1")
    Ms_db: Decibels = Field(6.0, description="largest peak of the sensitivity (dB)")
    delay: Delay = Field(0.0, description="additional delay (steps)")
    corners: list[Name] = Field([], max_length=100, description="cases whose loops must be stable")
    slopes: Bounds = Field([1.0, 1.0], description="incremental gains for which the corners are tested")
    delays: list[Delay] = Field(
        [0.0], min_length=1, max_length=20, description="additional delays (steps) for which the corners are tested"
    )


class ObjectiveSpec(pydantic.BaseModel):
    """The objective that Optuna minimises."""

    model_config = STRICT
    metric: Name
    over_cases: Literal["max", "mean"] = Field("max", description="how the values of several cases are combined")
    targets: dict[str, Positive] = Field(
        {}, description="reference value of the metric by case, so that easy and hard cases count alike; 1 by default"
    )
    limits: dict[Name, Number] = Field({}, description="upper limits of metrics, for every case")
    loop: LoopSpec | None = Field(None, description="limits of the linearised loop")

    def score(self, rows: Sequence[dict[str, Any]]) -> float:
        """Return the objective of a variation from its rows (one per case), or NaN if a run failed."""
        found = (row["metrics"].get(self.metric, math.nan) / self.targets.get(row["case"], 1.0) for row in rows)
        values: list[float] = list(found)
        if not all(map(math.isfinite, values)):
            return math.nan
        return max(values) if self.over_cases == "max" else sum(values) / len(values)


class StudySpec(pydantic.BaseModel):
    """Content of a study file."""

    model_config = STRICT
    name: Name
    text: str = ""
    scenario: str = Field(description="folder of the scenario, relative to the study file")
    cases: list[str] | None = Field(None, min_length=1, description="cases of the scenario; all by default")
    engine: Literal["native", "fmpy"] = Field("native", description="engine of `hystfmu run`")
    method: Literal["grid", "random", "sobol", "latin_hypercube", "optuna"] = Field(
        description="random: independent values; sobol, latin_hypercube: more even values; grid: all combinations"
    )
    n: int = Field(
        64,
        ge=1,
        le=MOST_ROWS,
        description="number of variations; for a grid, the product of the numbers of values instead",
    )
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] | Literal["run"] = Field(
        0, description="run: a random seed, chosen at the first run and stored with the table"
    )
    timeout: Annotated[float, Field(gt=0, le=1e6)] = Field(60.0, description="time limit of one run (s)")
    memory: Annotated[float, Field(gt=0, le=1e4)] = Field(4.0, description="memory limit of a worker (GB)")
    parameters: dict[str, ParameterSpec] = Field(min_length=1, max_length=1000)
    limits: dict[str, dict[Name, Number]] = Field(
        {}, description="upper limits of the metrics of each case; default: the limits of the scenario"
    )
    margins: Name | None = Field(
        None, description="case whose loop is linearised for every run: metrics Ms_db (dB) and radius (largest pole)"
    )
    objective: ObjectiveSpec | None = None
    start: dict[str, Number] = Field({}, description="optuna: the first variation, a value of every parameter")
    design: Design | None = Field(None, description="parameters that a design computes from the varied parameters")


def read_study(file: Path) -> StudySpec:
    """Read a study file and the files that it extends.

    Tables are merged key by key. A parameter replaces a parameter with the same name in the extended file. The limits
    of a case replace the limits of this case in the extended file. An InputError states the file, key, rule and value
    in one line. An InputError is also raised if the chain of files is too long or leaves the folder.
    """
    path, layers = file, list[dict[str, Any]]()
    while len(layers) < MOST_FILES:
        layers.append(load_toml(path, MOST_BYTES))
        below = layers[-1].pop("extends", None)
        if below is None:
            break
        path = inside(path.parent, str(below), f"{path}: extends", file.parent)
    else:
        raise InputError(f"{file}: extends: at most {MOST_FILES} files may extend each other")
    merged: dict[str, Any] = {}
    for layer in reversed(layers):
        for key, value in layer.items():
            both = isinstance(value, dict) and isinstance(merged.get(key), dict)
            merged[key] = merged[key] | value if both else value
    return check(merged, StudySpec, file)


class Study:
    """A study file at `path` (`*.study.toml`), with the cases of its scenario.

    Raises
    ------
    InputError
        The file is wrong. The message is one line with the file, key and rule.
    """

    def __init__(self, path: str | Path) -> None:
        self.file = Path(path)
        self.spec = read_study(self.file)
        scenario = Cases(self.file.parent / self.spec.scenario)
        have = {c.name: c for c in scenario.cases}
        names = self.spec.cases if self.spec.cases is not None else list(have)
        self._known("cases", names, have)
        self.cases: tuple[Case, ...] = tuple(have[n] for n in names)
        for key in self.spec.parameters:
            split_end(key, f"{self.file}: parameters")
        objective = self.spec.objective
        if (self.spec.method == "optuna") != (objective is not None):
            self._only_optuna("objective")
        if objective is not None:
            self._known("objective", [objective.metric, *objective.limits], scenario.spec.metrics, "metric")
            self._known("objective.targets", objective.targets, names)
        if objective is not None and (loop := objective.loop):
            self._known("objective.loop", [loop.case, *loop.corners], have)
        self._check_limits(names, have)
        self._check_design(have)
        self.seed = 0 if self.spec.seed == "run" else self.spec.seed  # for "run", the run chooses a random seed
        self.scenario_cases = have
        self._designed: dict[tuple[float, ...], dict[str, Any]] = {}
        self.parameters = {k: c for name, p in self.spec.parameters.items() for k, c in p.coordinates(name).items()}
        """Drawn parameters by `unit.parameter`, or `unit.block.f_n`."""
        self._check_start()
        if self.spec.method == "grid":
            sizes = [p.steps if p.values is None else len(p.values) for p in self.parameters.values()]
            if math.prod(sizes) > MOST_ROWS:
                raise InputError(f"{self.file}: the grid must have at most {MOST_ROWS} points")

    def _known(self, key: str, names: Iterable[str], have: Iterable[str], what: str = "case") -> None:
        """Raise an InputError if a name of the study file is unknown."""
        for name in (n for n in names if n not in have):
            raise InputError(f"{self.file}: {key}: no {what} {name!r}; there are {', '.join(have)}")

    def _only_optuna(self, key: str) -> NoReturn:
        got = self.spec.method
        raise InputError(f"{self.file}: {key}: must be given for the method 'optuna' only. Got {got!r} instead.")

    def _check_start(self) -> None:
        spec, where = self.spec, f"{self.file}: start"
        if not spec.start:
            return
        if spec.method != "optuna":
            self._only_optuna("start")
        if spec.start.keys() != self.parameters.keys():
            odd = sorted(spec.start.keys() ^ self.parameters.keys())
            raise InputError(f"{where}: must name the parameters, each once. {', '.join(odd)} is in one of them only.")
        for name, value in spec.start.items():
            p = self.parameters[name]
            if not (value in p.values if p.values is not None else p.bounds[0] <= value <= p.bounds[1]):
                raise InputError(f"{where}: {name}: must lie in its range. Got {value:g} instead.")

    def _check_design(self, have: Mapping[str, Case]) -> None:
        spec = self.spec
        of_design = [k for k in spec.parameters if k.startswith(PREFIX)]
        if spec.design is None:
            if of_design:
                raise InputError(f"{self.file}: parameters: {of_design[0]!r} needs a table [design]")
            return
        self._known("design", spec.design.reads, spec.parameters, "parameter")
        unread = [k for k in of_design if k not in spec.design.reads]
        if unread:
            raise InputError(f"{self.file}: parameters: {spec.design.method} has no {unread[0]!r}")
        self._known("design", spec.design.cases, have)

    def _check_limits(self, names: Sequence[str], have: Mapping[str, Case]) -> None:
        spec = self.spec
        # limits of cases that do not run are allowed, because an extended study may run these cases
        self._known("limits", spec.limits, have)
        if spec.margins is not None:
            self._known("margins", [spec.margins], names)
        for case in self.cases:
            known = [*case.metrics, *(LOOP_METRICS if case.name == spec.margins else ())]
            self._known(f"limits.{case.name}", spec.limits.get(case.name, {}), known, "metric")

    def limits(self, case: Case) -> dict[str, float]:
        """Return the upper limits of the metrics of a case."""
        if self.spec.limits:
            return self.spec.limits.get(case.name, {})
        return {name: m.limit for name, m in case.metrics.items() if m.limit is not None}

    def settings(self, values: Mapping[str, float]) -> dict[str, Any]:
        """Return the values of a variation as the key `set` of a case."""
        settings: dict[str, Any] = {}
        for name, p in self.spec.parameters.items():
            if name.startswith(PREFIX):
                continue
            drawn = [values[k] for k in p.coordinates(name)]
            settings |= p.second_order.settings(name, *drawn) if p.second_order else {name: p.setting(*drawn)}
        if self.spec.design is not None:
            key = tuple(values.values())
            if key not in self._designed:
                self._designed[key] = self.spec.design.settings(self.scenario_cases, values)
            settings |= self._designed[key]
        return settings
