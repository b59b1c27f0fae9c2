"""One run of a study: a case with a variation, the id of the run, and its row in the table.

The metrics of a run, and the objective of a study, may include the peak of the sensitivity of the linearised loop and
its stability in the worst-case parameter sets.
"""

import hashlib
import json
import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hystfmu.base import __version__
from hystfmu.base.errors import InputError
from hystfmu.scenario.engine.member import FmuStore
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.engine.simulation import Run, chunks_here, chunks_isolated
from hystfmu.scenario.loop.opened import SLOPES, OpenedLoop
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.scenario.outcome.metrics import Measure
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.case import sizes
from hystfmu.scenario.system.system import System, build
from hystfmu.studies.spec import LoopSpec, Study

RADIUS = 1 - 1e-6  # largest modulus of a stable pole; creep with a time constant of 10 s has a pole at 1 - 1e-5


class LoopLimits:
    """Limits of the linearised loop in the objective of a study, which can be tested for any variation."""

    def __init__(self, study: Study, spec: LoopSpec) -> None:
        self._spec = spec
        self._systems = {name: build(study.scenario_cases[name]) for name in {spec.case, *spec.corners}}

    def excess(self, settings: Mapping[str, Any]) -> dict[str, float]:
        """Return by how much a variation exceeds each limit. A value of at most 0 means that it meets the limit.

        The settings ``{"unit.parameter": value}`` have the form of `set` of a scenario.
        """
        spec = self._spec
        nominal = self._opened(spec.case, settings)
        found = {"Ms_db": math.inf}
        with suppress(InputError):  # without an inverse, the incremental gain is computed from a run, which may diverge
            peak = nominal.margins(delay=spec.delay)
            found = {"Ms_db": peak.Ms_db - spec.Ms_db if peak.stable else math.inf}
        corners = [self._opened(name, settings) for name in spec.corners]
        lo, hi = spec.slopes
        slopes = np.linspace(lo, hi, SLOPES)
        radii = [_radius(c, float(s), d) for c in corners for s in slopes for d in spec.delays]
        return found | {"radius": max(radii, default=0.0) - RADIUS}

    def _opened(self, case: str, settings: Mapping[str, Any]) -> OpenedLoop:
        lo, hi = self._spec.slopes
        return open_loop(_varied(self._systems[case], settings), (lo, hi))


def loop_metrics(system: System, settings: Mapping[str, Any]) -> dict[str, float]:
    """Return the metrics of the linearised loop of a case with the given settings.

    The loop is opened at the input of the plant.

    ``Ms_db`` is the peak of the sensitivity for the nominal incremental gain (dB), or infinity for an unstable loop.
    ``radius`` is the largest modulus of a pole for the incremental gains along the path of the case.
    """
    # the linearised loop has one sampling rate
    fine = {k: float(settings[k]) % 1 for k in sizes(system.case) & settings.keys()}
    whole = {k: v - fine[k] if k in fine else v for k, v in settings.items()}
    opened = open_loop(_varied(system, whole))
    delay = sum(fine.values())
    found = opened.margins(delay=delay)
    slopes = np.linspace(*opened.slopes, SLOPES)
    radius = max(opened.radius(float(s), delay) for s in slopes)
    return {"Ms_db": found.Ms_db if found.stable else math.inf, "radius": radius}


def _radius(opened: OpenedLoop, slope: float, delay: float) -> float:
    """Return the largest modulus of a pole of the closed loop.

    For a loop with a period memory, the computed bound may exceed 1 although the loop is stable. Therefore the result
    is computed for the loop without this memory.
    """
    if opened.memories and opened.stable(slope, delay):
        opened = replace(opened, memories=())
    return opened.radius(slope, delay)


OUTSIDE = "outside"
"""Status of an omitted run, whose variation breaks a limit of the linearised loop."""


@dataclass(frozen=True)
class Task:
    """One run: a case with a variation. `index` is the row of the table; `settings` has the form of `set` in a case."""

    index: int
    variation: int
    case: int
    id: str
    values: dict[str, float]
    settings: dict[str, Any]
    margins: bool = False
    """True if the loop is also linearised."""


def fingerprint(system: System) -> str:
    """Return a hash of all data that determine the results of a case.

    The data are units, values, connections, time grid, metrics and version. A stored row is used in another study only
    if this hash and the variation agree.
    """
    case = system.case
    content = {
        "version": __version__,
        "units": [[p.name, p.graph.token, p.runs_as, p.period, p.constants, p.substeps, p.hold] for p in system.parts],
        "links": [[n.to, n.input, n.source] for n in system.links],
        "grid": [case.step, case.stop, case.ripple],
        "coupling": case.coupling.model_dump(),
        "metrics": {k: m.model_dump(exclude={"limit", "text"}) for k, m in case.metrics.items()},
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def identity(of_case: str, settings: dict[str, Any], margins: bool = False) -> str:
    """Return the id of a run, which is the same on every computer."""
    content = [of_case, settings, *(["margins"] if margins else [])]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:24]


def row_of(task: Task, case: str, status: str, reason: str, metrics: dict[str, float] | None = None) -> dict[str, Any]:
    """Return the row of a task in the table. `reason` states why the run has no metrics, or is ""."""
    row = {"index": task.index, "variation": task.variation, "id": task.id, "case": case, "values": task.values}
    return {**row, "metrics": metrics or {}, "status": status, "reason": reason}


def _varied(system: System, settings: Mapping[str, Any]) -> System:
    return build(replace(system.case, overrides={**system.case.overrides, **settings}))


class Runner:
    """Runs tasks in one process, and reuses prepared systems. `systems` contains the cases of the study in order.

    FMUs are unpacked in `folder`, by default the folder for temporary files. If `apart` is True, each run with foreign
    FMUs is in a separate child process. If it is False, the caller must supervise and confine this process.
    """

    def __init__(self, systems: list[System], run: Run, folder: str | None = None, apart: bool = False) -> None:
        self._systems, self._run, self._folder, self._apart = systems, run, folder, apart
        self._native: dict[tuple[object, ...], Native] = {}
        self._store: FmuStore | None = None

    def __call__(self, task: Task) -> dict[str, Any]:
        """Run a task and return its row. The row of a failed run contains the reason."""
        case = self._systems[task.case].case.name
        try:
            return row_of(task, case, "ok", "", self._metrics(task))
        except Stopped as e:
            return row_of(task, case, e.status, str(e))
        except InputError as e:
            return row_of(task, case, "refused", str(e))
        except MemoryError:
            return row_of(task, case, "memory", "the run exceeds the memory limit of a worker")

    def _metrics(self, task: Task) -> dict[str, float]:
        system = self._systems[task.case]
        metrics = system.case.metrics
        apart = self._apart and bool(system.foreign)
        if self._run.engine == "native" and not apart:
            chunks = self._prepared(task).chunks()
        else:
            varied = _varied(system, task.settings)
            missing = [k for k in task.settings if k not in varied.overridden]
            if missing:
                raise InputError(f"{missing[0]}: the case {system.case.name} has no unit with this parameter")
            if apart:
                chunks = chunks_isolated(varied, self._run)
            else:
                self._store = self._store or FmuStore(self._folder)
                chunks = chunks_here(varied, self._run.engine, self._store)
        measured = {name: Measure(m) for name, m in metrics.items()}
        for chunk in chunks:
            for m in measured.values():
                m.add(chunk)
        found = {name: m.value() for name, m in measured.items()}
        return found | (loop_metrics(system, task.settings) if task.margins else {})

    def _prepared(self, task: Task) -> Native:
        """Return the prepared system of a case in the C core with the settings of a task."""
        system = self._systems[task.case]
        structure = {k: v for k, v in task.settings.items() if k in sizes(system.case)}
        key = (task.case, *sorted(structure.items()))
        if key not in self._native:
            ends = [e for m in system.case.metrics.values() for e in (m.signal, m.against) if e is not None]
            self._native[key] = Native(_varied(system, structure) if structure else system, ends)
        self._native[key].set({k: v for k, v in task.settings.items() if k not in structure})
        return self._native[key]

    def close(self) -> None:
        """Remove the unpacked FMUs."""
        if self._store is not None:
            self._store.close()
