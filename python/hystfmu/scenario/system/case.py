"""The cases of a scenario: every `[[case]]` overrides keys of the scenario. They are checked without models.

The rest of the program only uses complete cases.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from hystfmu.base.errors import InputError
from hystfmu.model import Model
from hystfmu.scenario.system.extends import read_scenario
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.spec import CaseSpec, CouplingSpec, MetricSpec, ScenarioSpec, Scheme, TubeSpec, UnitSpec

MOST_STEPS = 20_000_000  # of the finest unit in one case
NAME = r"[A-Za-z][A-Za-z0-9_]*"
_END = re.compile(rf"({NAME})\.({NAME})\Z")


@dataclass(frozen=True)
class Case:
    """One complete case of a scenario."""

    scenario: str
    about: str
    name: str
    text: str
    folder: Path | None
    """Folder of the files. None if the case was built in Python and uses the content of `attached`."""
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
    """Overrides from the command line. They apply if the unit and the parameter exist."""
    guard: float | None = None
    tube: TubeSpec | None = None
    final_states: bool = False
    origin: str = ""
    """Prefix of errors: the file of the case, or the name of a scenario built in Python."""
    attached: Mapping[str, Model | Foreign | Path] = field(default_factory=dict)
    """Objects for paths of units that are not files of the folder."""

    def __repr__(self) -> str:
        return f"Case({self.title!r}, units {', '.join(self.order)})"

    @property
    def title(self) -> str:
        """Title `scenario/case` for errors and reports."""
        return f"{self.scenario}/{self.name}"

    @property
    def description(self) -> str:
        """Label of one line, which is unique among the cases of all scenarios."""
        return f"scenario {self.title}" + (f": {self.about}" if self.about else "")

    @property
    def where(self) -> str:
        """Prefix of errors: file or scenario, and the case."""
        return f"{self.origin}: case {self.name}"


def split_end(end: str, where: str) -> tuple[str, str]:
    """Split `unit.variable` into the two names. Errors begin with `where`, which contains file and key."""
    m = _END.match(end)
    if not m:
        raise InputError(f"{where}: must read 'unit.variable'; got {end!r}")
    return m[1], m[2]


class ScenarioLike(Protocol):
    """A scenario that was built in Python, or complete cases."""

    def ready(self) -> Cases:
        """Return the complete cases."""


class Cases:
    """The complete cases of a scenario, read from a `scenario.toml` and checked.

    Parameters
    ----------
    path : path
        The file, or the folder that contains it.
    overrides : mapping of str to value
        Values ``{"unit.parameter": value}`` that override all other values, in the cases with this parameter.
    coupling : str, optional
        Coupling scheme for all cases; it replaces the schemes of the cases.

    Raises
    ------
    InputError
        The file is invalid. The message states file, key, rule and value in one line.
    """

    def __init__(
        self, path: str | Path, overrides: dict[str, Any] | None = None, coupling: Scheme | None = None
    ) -> None:
        path = Path(path)
        if path.suffix != ".toml" and path.is_file():
            raise InputError(
                f"{path}: The scenario must be a folder with a scenario.toml, or a file .toml. Got a file."
            )
        file = path / "scenario.toml" if path.suffix != ".toml" else path
        self.folder: Path | None = file.parent
        self._complete(read_scenario(file), str(file), {}, overrides, coupling)

    def __repr__(self) -> str:
        return f"Cases({self.origin!r}, {len(self.cases)} case{'' if len(self.cases) == 1 else 's'})"

    @classmethod
    def of(
        cls,
        spec: ScenarioSpec,
        origin: str,
        attached: Mapping[str, Model | Path],
        folder: Path | None = None,
        overrides: dict[str, Any] | None = None,
        coupling: Scheme | None = None,
    ) -> Cases:
        """Return a scenario without a file, or with changes.

        Parameters
        ----------
        spec : ScenarioSpec
        origin : str
            Prefix of every error.
        attached : dict
            Models or files for paths of units that are not files of the folder.
        folder : path, optional
            Folder of the files and of the baseline.
        overrides, coupling
            See `Cases`.
        """
        made = cls.__new__(cls)
        made.folder = folder
        made._complete(spec, origin, attached, overrides, coupling)
        return made

    def ready(self) -> Cases:
        """Return these cases, which are complete."""
        return self

    def named(self, name: str | None) -> Case:
        """Return the case with this name; by default the first case.

        Raises
        ------
        InputError
            There is no such case.
        """
        found = self.cases[0] if name is None else next((c for c in self.cases if c.name == name), None)
        if found is None:
            raise InputError(f"{self.origin}: no case {name!r}; there are {', '.join(c.name for c in self.cases)}")
        return found

    def changed(self, overrides: dict[str, Any] | None, coupling: Scheme | None) -> Cases:
        """Return the scenario with other `overrides` and `coupling`, see `Cases`."""
        return Cases.of(self.spec, self.origin, self.attached, self.folder, overrides, coupling)

    def _complete(
        self,
        spec: ScenarioSpec,
        origin: str,
        attached: Mapping[str, Model | Path],
        overrides: dict[str, Any] | None,
        coupling: Scheme | None,
    ) -> None:
        self.spec, self.origin, self.attached = spec, origin, attached
        self.overrides, self.coupling = dict(overrides or {}), coupling
        self.cases = self._cases()

    def _cases(self) -> tuple[Case, ...]:
        specs = self.spec.case or [CaseSpec.model_validate({"name": "nominal"})]
        names = [c.name for c in specs]
        for n in names:
            if names.count(n) > 1:
                raise InputError(f"{self.origin}: case: two cases have the name {n!r}")
        return tuple(self._case(c) for c in specs)

    def _case(self, c: CaseSpec) -> Case:
        s, where = self.spec, f"{self.origin}: case {c.name}"
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
            order=tuple(c.order if c.order is not None else [*s.order, *(u for u in c.units if u not in s.units)]),
            coupling=coupling,
            units=units,
            connections={**s.connections, **c.connections},
            metrics=metrics,
            record=tuple(s.record),
            loops=tuple((a, b) for a, b in s.loops),
            delay=s.delay,
            tolerance=s.tolerance,
            guard=s.guard,
            tube=s.tube,
            final_states=s.final_states,
            origin=self.origin,
            attached=self.attached,
            overrides=self.overrides,
        )
        self._check(case, where)
        return case

    @staticmethod
    def _check(case: Case, where: str) -> None:
        """Check all properties that need no model: order, length of the run, and window of the metrics."""
        twice = {u for u in case.order if case.order.count(u) > 1}
        missing, unknown = set(case.units) - set(case.order), set(case.order) - set(case.units)
        if twice or missing or unknown:
            wrong = f"twice: {sorted(twice)}" if twice else f"missing: {sorted(missing)}, unknown: {sorted(unknown)}"
            raise InputError(f"{where}: order: must name every unit once; {wrong}")
        steps = case.stop / case.step
        if not math.isfinite(steps) or abs(steps - round(steps)) > 1e-6 * steps or steps < 1:
            raise InputError(f"{where}: stop: must be a multiple of the step {case.step:g} s; got {case.stop:g}")
        if steps * case.ripple > MOST_STEPS:
            raise InputError(f"{where}: stop: at most {MOST_STEPS} fine steps; got {steps * case.ripple:.0f}")
        for name, m in case.metrics.items():
            if m.after >= case.stop:
                raise InputError(f"{where}: metrics.{name}.after: must be below stop {case.stop:g} s; got {m.after:g}")
