"""Files of scenarios: their folders, the keys of a scenario.toml, and `extends`.

Several scenarios may form a group, which is a folder in the folder of all scenarios. With the key `extends`, a file
states only the differences from another file. Tables are merged key by key. Numbers, texts and lists replace the value
in the extended file. Three rules keep the result readable:

- A unit that names its source (model, block, graph, inverse_of, fmu) replaces the unit of that name as a whole.
- If `extends` lists several files, a later file has priority over an earlier file.
- A case states the differences from the case of the same name in the extended file. If a file lists cases, these run
  in this order; otherwise the cases of the extended file run. A name with ``*`` or ``?`` stands for all matching cases
  of the extended file that the file does not name elsewhere.

A condition contains settings that several cases use, such as a worst-case parameter set, a signal or a delay. A case
applies its conditions in the order of its list. Later conditions have priority over earlier conditions, and the keys of
the case have the highest priority. If a case has no text, the texts of its conditions are used.
"""

import os
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import pydantic
from pydantic import Field

from hystfmu.base import PACKAGE, InputError, check, check_format, load_toml
from hystfmu.graph.tables import STRICT, Bounds, GraphTable, Name, NotNegative, Number, Positive, Share, TwoNames, Value

FILE = "scenario.toml"


def is_relative(path: str) -> bool:
    """Return whether a path is relative and uses only '/' as separator."""
    return not (Path(path).is_absolute() or "\\" in path or ":" in path)


def inside(folder: Path, relative: str, where: str, scenario: Path | None = None) -> Path:
    """Return the path of a file that a scenario file in `folder` states, if it is inside the scenario folders.

    `scenario` is the folder of the scenario, by default `folder`. Its parent folder contains all scenarios or a group
    of scenarios. An InputError is raised if the path is absolute or leads out of the folder of all scenarios, for
    example through a symbolic link. Error messages begin with `where`.
    """
    if not is_relative(relative):
        raise InputError(f"{where}: must be a path relative to the scenario, with '/'; got {relative!r}")
    root = _root((scenario or folder).resolve())
    try:
        path = (folder.resolve() / relative).resolve()
    except (OSError, RuntimeError, ValueError) as e:  # symbolic links in a circle, or a path with a zero byte
        raise InputError(f"{where}: {e}; got {relative!r}") from None
    if not path.is_relative_to(root):
        raise InputError(f"{where}: must stay within the folder of the scenarios; got {relative!r}")
    return path


def _root(scenario: Path) -> Path:
    """Return the folder of all scenarios: the parent of a scenario, or of its group."""
    group = scenario.parent
    if (group / FILE).exists():
        return group
    beside = (p.parent for p in group.parent.glob(f"*/{FILE}"))
    return group.parent if any(p != group for p in beside) else group


def scenario_folders(folder: Path) -> list[Path]:
    """Return the sorted folders of scenarios in a group. If there are none, return only the folder itself."""
    if (folder / FILE).exists() or not folder.is_dir():
        return [folder]
    return sorted(p.parent for p in folder.glob(f"*/{FILE}")) or [folder]


def shipped_scenarios() -> Path:
    """Return the folder of the shipped scenarios, or raise an InputError if they are not installed."""
    for folder in (PACKAGE / "_scenarios", PACKAGE.parents[1] / "scenarios"):
        if folder.is_dir():
            return folder
    raise InputError(f"no scenarios in {PACKAGE / '_scenarios'}: install the package with 'pip install .'")


def shipped_names() -> list[str]:
    """Return the names of the shipped scenarios, such as ``scenarios/pid``.

    The list is empty if they are not installed.
    """
    try:
        root = shipped_scenarios()
    except InputError:
        return []
    return sorted(f"scenarios/{f.parent.relative_to(root).as_posix()}" for f in root.rglob("scenario.toml"))


def here_or_shipped(path: str) -> Path:
    """Return a path. If it is `scenarios/...` and does not exist, return the path of the shipped scenario."""
    first, *inside = Path(path).parts or (".",)
    if first != "scenarios" or Path(path).exists():
        return Path(path)
    try:
        found = shipped_scenarios().joinpath(*inside)
    except InputError:
        return Path(path)
    return found if found.exists() else Path(path)


FORMAT: Literal[1] = 1
Decibels = Annotated[float, Field(gt=0, le=60)]
Delay = Annotated[float, Field(ge=0, le=100)]  # steps


SOURCES = {"model", "block", "graph", "inverse_of", "fmu"}  # keys that state the content of a unit


class UnitSpec(pydantic.BaseModel):
    """One unit. Exactly one of `model`, `block`, `graph`, `inverse_of` and `fmu` states the content."""

    model_config = STRICT
    model: str | None = Field(None, description="path of a *.model.toml, relative to the scenario's folder")
    block: str | None = Field(None, description="name of a block; `dims` and `values` state its sizes and values")
    dims: dict[str, int] = Field({}, description="sizes of `block`")
    values: dict[str, Value] = Field({}, description="parameter values of `block`")
    fmu: str | None = Field(None, description="path of a foreign FMU, relative to the scenario's folder")
    graph: GraphTable | None = Field(None, description="blocks, wires, inputs, outputs, as in a model file")
    inverse_of: str | None = Field(
        None, description="path of a *.model.toml; the unit is the exact inverse of this model"
    )
    runs_as: Literal["fmu2", "fmu3"] = Field("fmu2", alias="as", description="version of FMI, for the engine fmpy")
    every: int = Field(1, ge=1, le=1_000_000, description="number of steps in a period of the unit")
    fine: bool = Field(
        False, description="the unit makes `ripple` steps in each step: for plants and for signals between samples"
    )
    substeps: int = Field(1, ge=1, le=10_000, description="steps of the unit in each of its periods")
    hold: Literal["zero", "first"] = Field(
        "zero", description="connected inputs during a period: constant, or linear through the last two values"
    )
    inputs: dict[str, Number] = Field({}, description="constant values of inputs without a connection")
    set: dict[str, Value] = Field({}, description="new parameter values; the string '*1.2' multiplies the old value")
    text: str = Field("", description="description in one line")

    @pydantic.model_validator(mode="after")
    def _one_source(self) -> "UnitSpec":
        given = sorted(k for k in SOURCES if getattr(self, k) is not None)
        if len(given) != 1:
            raise ValueError(f"a unit has exactly one of model, block, graph, inverse_of, fmu; here: {given or 'none'}")
        if self.block is None and (self.dims or self.values):
            raise ValueError("dims and values need 'block'; use 'set' to change parameters of a model")
        if self.fine and self.every != 1:
            raise ValueError("a unit must not have both 'fine' and 'every'")
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
    """A metric: a number computed from signals, and the limit that it must not exceed."""

    model_config = STRICT
    kind: MetricKind = Field(description="kind of metric, see hystfmu.Scenario.metric")
    signal: str = Field(description="unit.output")
    against: str | None = Field(None, description="unit.output with which the signal is compared")
    stroke: Positive | None = Field(
        None, description="value that corresponds to 100 percent; default: span of `against` in the window"
    )
    after: NotNegative = Field(0.0, description="only rows at or after this time (s) are used")
    lines: bool = Field(
        False, description="rms_percent, rms and max_percent: only rows where `against` has constant speed"
    )
    limit: NotNegative | None = Field(None, description="largest allowed value; a case may state another one")
    text: str = Field("", description="description in one line")

    @pydantic.model_validator(mode="after")
    def _partner(self) -> "MetricSpec":
        if self.kind not in ("peak", "final") and self.against is None:
            raise ValueError(f"{self.kind} needs 'against'")
        if self.lines and self.kind not in ("rms_percent", "rms", "max_percent"):
            raise ValueError(f"'lines' belongs to rms_percent, rms and max_percent. Got {self.kind} instead.")
        return self


Scheme = Literal["gauss_seidel", "jacobi", "iterative"]


class CouplingSpec(pydantic.BaseModel):
    """Coupling scheme: exchange of values between units that make a step at the same time."""

    model_config = STRICT
    scheme: Scheme = Field(
        "gauss_seidel",
        description="gauss_seidel: the units step in the stated order and use the newest values; jacobi: all units use "
        "the values of the last step; iterative: the step is repeated until the inputs agree with the outputs, by "
        "Newton's method if all units in loops have tangents",
    )
    events: Literal["located", "grid"] = Field(
        "located",
        description="discontinuities, kinks and reversals of references between two communication points; located: a "
        "step ends on each event, for units that run at the finest rate and have no sampled block; grid: an event "
        "takes effect at the next step",
    )
    tolerance: Positive = Field(
        1e-12, description="iterative: largest difference between an input and its source, relative to 1 + |value|"
    )
    max_sweeps: int = Field(50, ge=2, le=10_000, description="iterative: largest number of sweeps in a step")


class TubeSpec(pydantic.BaseModel):
    """Tolerances of recorded signals in time and value, which replace `tolerance`."""

    model_config = STRICT
    time: NotNegative = Field(0.0, description="largest shift in time (s)")
    value: Share = Field(description="largest deviation, relative to the largest value of the signal")


class MarginsSpec(pydantic.BaseModel):
    """Limits of the linearised loop, in addition to the limits of metrics."""

    model_config = STRICT
    case: Name | None = Field(
        None, description="case whose sensitivity is limited, for an incremental gain of 1; default: the first case"
    )
    Ms_db: Decibels | None = Field(None, description="largest peak of its sensitivity (dB)")
    corners: list[Annotated[str, Field(pattern=r"^[A-Za-z0-9_.\-?*]+$", max_length=64)]] = Field(
        ["*"],
        max_length=100,
        description="cases whose loops must be stable; ? stands for one character, * for any number",
    )
    slopes: Bounds | None = Field(
        None, description="incremental gains in the corners; default: the incremental gains in the run of each case"
    )
    stable_to_steps: Delay | None = Field(
        None, description="additional delay (steps) up to which each corner must be stable"
    )
    expected_unstable: list[Name] = Field(
        [],
        max_length=100,
        description="cases whose linear loop is unstable for an incremental gain in their run, although the run meets "
        "the limits; any other such case fails",
    )


class ConditionSpec(pydantic.BaseModel):
    """Keys of a scenario that a case or a condition can override."""

    model_config = STRICT
    text: str = Field("", description="description in one line")
    stop: Positive | None = Field(None, description="end of the run (s)")
    after: NotNegative | None = Field(None, description="`after` of all metrics")
    set: dict[str, Value] = Field({}, description="'unit.parameter' = value, or '*1.2' to multiply the old value")
    units: dict[Name, UnitSpec] = Field({}, description="units that are added or replaced as a whole")
    order: list[Name] | None = Field(
        None, description="order of the units; default: the order of the scenario, then the units that the case adds"
    )
    connections: dict[str, str] = Field({}, description="connections that are added or replaced")
    limits: dict[Name, NotNegative] = Field({}, description="limits of metrics, by name")


class CaseSpec(ConditionSpec):
    """A case, which states the differences from the scenario."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.\-]*$", max_length=64)]
    conditions: list[Name] = Field([], description="names of conditions; later conditions override earlier ones")
    coupling: CouplingSpec | None = Field(None, description="coupling of this case, if it differs")


class ScenarioSpec(pydantic.BaseModel):
    """Content of a scenario.toml."""

    model_config = STRICT
    format: Literal[1] = Field(FORMAT, description="version of the file format")
    name: Name
    text: str = ""
    delay: str = Field("", description="note on delays in the loop; the report shows it beside the computed delays")
    step: Positive = Field(description="step of the units (s)")
    stop: Positive = Field(description="end of the run (s)")
    ripple: int = Field(
        1,
        ge=1,
        le=1000,
        description="number of steps of a fine unit in each step; the command is constant during a step",
    )
    order: list[Name] = Field(
        min_length=1, max_length=200, description="order in which the units step; each unit uses the newest values"
    )
    coupling: CouplingSpec = Field(CouplingSpec.model_validate({}), description="how units exchange values")
    units: dict[Name, UnitSpec] = Field(min_length=1, max_length=200)
    connections: dict[str, str] = Field({}, description="'unit.input' = 'unit.output'")
    record: list[str] = Field([], description="outputs stored in baseline.csv and shown in the report")
    loops: list[TwoNames] = Field([], description="pairs of signals (abscissa, ordinate) drawn as loops")
    metrics: dict[Name, MetricSpec] = Field(min_length=1, max_length=100)
    tolerance: Share = Field(
        1e-6, description="largest permitted relative change of a metric or recorded signal from the baseline"
    )
    guard: Annotated[float, Field(ge=1, allow_inf_nan=False)] | None = Field(
        None, description="largest multiple of its recorded value that a metric may reach, beside its limit"
    )
    tube: TubeSpec | None = Field(None, description="permitted deviations of recorded signals, instead of `tolerance`")
    final_states: bool = Field(False, description="the final states of all units must be bit-identical to the baseline")
    conditions: dict[Name, ConditionSpec] = Field({}, description="parts that several cases have in common")
    margins: MarginsSpec | None = Field(None, description="limits of the linearised loop: see hystfmu margins")
    case: list[CaseSpec] = Field(
        [], max_length=200, description="cases; a scenario without cases has the single case 'nominal'"
    )


MOST_BYTES = 2**20  # size limit of each file (bytes)
MOST_FILES = 8  # largest number of files in a chain of `extends`
_FILES = ("model", "inverse_of", "fmu")  # keys of a unit whose value is a file name

Table = dict[str, Any]


def read_scenario(file: Path) -> ScenarioSpec:
    """Read a scenario.toml and the files that it extends, and check the merged result.

    An error message states the file with the wrong key, the key, the rule and the value. An InputError is also raised
    if the chain of files is too long, contains a file twice, or leaves the folder of the scenarios.
    """
    layers = _chain(file)
    try:
        merged, run = layers[-1][1], _length(layers[-1][1])
        for k, (path, own) in reversed(list(enumerate(layers[:-1]))):
            _names_once(merged.get("case"), path)
            if isinstance(own.get("case"), list):
                own = own | {"case": _chosen(merged.get("case"), run, own["case"], path)}
                layers[k], run = (path, own), _length(own)
            merged = _merge(merged, own)
        if isinstance(merged.get("case"), list):
            merged["case"] = merged["case"][:run]  # the later cases are only templates of other cases and do not run
    except RecursionError:
        raise InputError(f"{file}: tables are nested too deep") from None
    return with_conditions(check(merged, ScenarioSpec, lambda key: _origin(layers, merged, key)), file)


def _chain(file: Path) -> list[tuple[Path, Table]]:
    """Return a file and the files that it extends, with their tables. Paths are relative to the first file."""
    layers: list[tuple[Path, Table]] = []
    waiting, seen = [file], [file.resolve()]
    while waiting:
        path = waiting.pop(0)
        try:
            table = load_toml(path, MOST_BYTES)
        except InputError as e:
            raise InputError(f"{layers[-1][0]}: extends: {e}" if layers else str(e)) from None
        check_format(table, FORMAT, path)
        below, where = table.pop("extends", []), f"{path}: extends"
        names = below if isinstance(below, list) else [below]
        if not all(isinstance(name, str) for name in names):
            raise InputError(
                f"{where}: must be the path of a scenario file, or a list of them; got {str(below)[:80]!r}"
            )
        layers.append((path, _rebased(table, path.parent, file.parent)))
        targets = [inside(path.parent, name, where, file.parent) for name in names]
        for name, target in zip(names, targets, strict=True):
            if target in seen:
                raise InputError(f"{where}: returns to {name!r}: files must not extend each other")
            seen.append(target)
        if len(seen) > MOST_FILES:
            raise InputError(f"{where}: at most {MOST_FILES} files may extend each other")
        # the last file of a list, with the files that it extends, has priority
        waiting = [*reversed(targets), *waiting]
    return layers


def _merge(below: Table, own: Mapping[str, Any]) -> Table:
    """Return `below` merged with `own` by the rules of this module. Values in `own` have priority."""
    merged = dict(below)
    for key, value in own.items():
        was = below.get(key)
        if key == "case" and isinstance(value, list) and isinstance(was, list):
            merged[key] = _merge_cases(was, value)
        elif isinstance(value, dict) and isinstance(was, dict) and not value.keys() & SOURCES:
            merged[key] = _merge(was, value)
        else:
            merged[key] = value
    return merged


def _merge_cases(below: list[Any], own: list[Any]) -> list[Any]:
    """Return the cases of `own`, merged with the cases of the same name in `below`, and then the other cases."""
    base = {c["name"]: c for c in below if _is_named(c)}
    names = [c["name"] for c in own if _is_named(c)]
    merged = [_merge(base.get(c["name"], {}), c) if _is_named(c) else c for c in own]
    return merged + [c for name, c in base.items() if name not in names]


def _chosen(below: Any, run: int, own: list[Any], path: Path) -> list[Any]:
    """Return the cases `own`. The matching cases of `below` replace each case whose name is a pattern.

    The replacement has the keys of the pattern and the name of the matching case. A pattern can match only the first
    `run` cases of `below`.
    """
    patterns = [c for c in own if _is_named(c) and set(c["name"]) & set("*?")]
    taken = {c["name"] for c in own if _is_named(c)}
    found: list[Any] = []
    for case in own:
        if not any(case is p for p in patterns):
            found.append(case)
            continue
        free = [c["name"] for c in below[:run] if _is_named(c)] if isinstance(below, list) else []
        names = [name for name in free if name not in taken and fnmatchcase(name, case["name"])]
        if not names:
            raise InputError(f"{path}: case {case['name']}: the file that it extends has no case of this name")
        taken.update(names)
        found += [case | {"name": name} for name in names]
    return found


def _length(table: Table) -> int:
    return len(table["case"]) if isinstance(table.get("case"), list) else 0


def _is_named(case: Any) -> bool:
    return isinstance(case, dict) and isinstance(case.get("name"), str)


def _names_once(cases: Any, path: Path) -> None:
    names = [c["name"] for c in cases if _is_named(c)] if isinstance(cases, list) else []
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{path}: extends: two cases have the name {name!r}")


def _rebased(table: Table, home: Path, folder: Path) -> Table:
    """Return a table in which paths are relative to `folder` instead of `home`, the folder of the file."""
    if home == folder:
        return table
    way = os.path.relpath(home.resolve(), folder.resolve())
    cases, conditions = table.get("case"), table.get("conditions")
    owners = [
        *(cases if isinstance(cases, list) else ()),
        *(conditions.values() if isinstance(conditions, dict) else ()),
    ]
    for owner in (table, *owners):
        units = owner.get("units") if isinstance(owner, dict) else None
        for unit in units.values() if isinstance(units, dict) else ():
            for key in _FILES:
                name = unit.get(key) if isinstance(unit, dict) else None
                if isinstance(name, str) and is_relative(name):
                    unit[key] = Path(os.path.normpath(f"{way}/{name}")).as_posix()
    return table


def _origin(layers: Sequence[tuple[Path, Table]], merged: Table, key: Sequence[str | int]) -> Path:
    """Return the file that states a key of the merged table, or the first file if no file states the key."""

    def known(table: Any) -> int:
        """Return how many leading parts of the key a file contains."""
        for depth, part in enumerate(key):
            if depth == 1 and key[0] == "case" and isinstance(table, list):
                table = {i: own for i, case in enumerate(merged["case"]) for own in table if _are_same(own, case)}
            try:
                table = table[part]
            except (LookupError, TypeError):
                return depth
        return len(key)

    return max(layers, key=lambda layer: known(layer[1]))[0]


def _are_same(own: Any, case: Any) -> bool:
    """Return whether a case of a file is part of this case of the merged table."""
    return own is case or (_is_named(own) and _is_named(case) and own["name"] == case["name"])


Spec = TypeVar("Spec", CaseSpec, ScenarioSpec)
_LAST = ("stop", "after", "order")  # for these keys, the last stated value is used


def with_conditions(spec: ScenarioSpec, file: Path) -> ScenarioSpec:
    """Return the scenario with conditions merged into its cases. An unknown condition raises an InputError."""
    cases = [_complete(case, spec, file) if case.conditions else case for case in spec.case]
    return _without_conditions(spec.model_copy(update={"case": cases} if cases else {}))


def _complete(case: CaseSpec, spec: ScenarioSpec, file: Path) -> CaseSpec:
    for name in case.conditions:
        if name not in spec.conditions:
            where = f"{file}: case {case.name}: conditions"
            raise InputError(f"{where}: no condition {name!r}; there are {sorted(spec.conditions)}")
    layers: list[ConditionSpec] = [*(spec.conditions[name] for name in case.conditions), case]
    found: dict[str, Any] = {"text": case.text or ", ".join(c.text for c in layers if c.text)}
    for key in ("set", "units", "connections", "limits"):
        found[key] = {name: value for c in layers for name, value in getattr(c, key).items()}
    for key in _LAST:
        found[key] = next((value for c in reversed(layers) if (value := getattr(c, key)) is not None), None)
    return _without_conditions(
        case.model_copy(update={key: value for key, value in found.items() if value not in (None, "", {})})
    )


def _without_conditions(spec: Spec) -> Spec:
    """Return a copy without conditions, so that a saved file has none."""
    made = spec.model_copy(update={"conditions": type(spec.conditions)()})
    made.model_fields_set.discard("conditions")
    return made
