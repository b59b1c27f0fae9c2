"""One run of a study: a case with a variation, the id of the run, and its row in the table; choice of the variations.

The variations are a grid, random values, Sobol points, a Latin hypercube, or proposals of Optuna.

The metrics of a run, and the objective of a study, may include the peak of the sensitivity of the linearised loop and
its stability in the worst-case parameter sets.
"""

import hashlib
import itertools
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hystfmu.base import Array, InputError, __version__, extras
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
    radius = max(_radius(opened, s, delay) for s in opened.tested)
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


class Fixed:
    """A fixed list of `n` variations, which are proposed in one batch. Another sampler overrides the methods."""

    def __init__(self, variations: list[dict[str, float]], n: int | None = None) -> None:
        self._variations, self.n = variations, len(variations) if n is None else n

    def batches(self) -> Iterator[list[dict[str, float]]]:
        """Yield batches of variations `{"unit.parameter": value}`. The runs of a batch end before the next batch."""
        yield self._variations

    def tell(self, rows: Sequence[Sequence[dict[str, Any]]]) -> None:
        """Receive the rows of the last batch, in the order of its variations, with one row per case."""

    def outside(self, k: int) -> str:
        """Return the limits that variation k of the last batch exceeds, as far as they are known without a simulation.

        The limits are returned as text. The variation is simulated only if this text is empty.
        """
        return ""


class Asked(Fixed):
    """Optuna's TPE sampler with a fixed seed and batch size. The number of workers does not change the variations.

    A resumed study proposes the same variations, and finds their rows in the table. Therefore an interruption does not
    change the result.
    """

    BATCH = 8

    def __init__(self, study: Study) -> None:
        with extras("the method 'optuna'"):
            import optuna
        super().__init__([], study.spec.n)
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self._study, self._optuna, self._trials = study, optuna, []  # type: ignore[var-annotated]
        objective = study.spec.objective
        assert objective is not None
        self._objective = objective
        self._loop = LoopLimits(study, objective.loop) if objective.loop else None
        self._excess: list[dict[str, float]] = []
        sampler = optuna.samplers.TPESampler(seed=study.seed)
        self._asker = optuna.create_study(direction="minimize", sampler=sampler)
        if study.spec.start:
            self._asker.enqueue_trial(dict(study.spec.start))

    def batches(self) -> Iterator[list[dict[str, float]]]:
        """Yield batches of at most `BATCH` variations."""
        left = self.n
        while left:
            self._trials = [self._asker.ask() for _ in range(min(self.BATCH, left))]
            left -= len(self._trials)
            batch = [self._ask(t) for t in self._trials]
            self._excess = [self._loop.excess(self._study.settings(v)) if self._loop else {} for v in batch]
            yield batch

    def outside(self, k: int) -> str:
        """Return the limits of the linearised loop that variation k exceeds. No simulation is needed to know them."""
        return ", ".join(name for name, excess in self._excess[k].items() if excess > 0)

    def _ask(self, trial: Any) -> dict[str, float]:
        values = {}
        for name, p in self._study.parameters.items():
            if p.values is not None:
                values[name] = float(trial.suggest_categorical(name, p.values))
            else:
                values[name] = float(trial.suggest_float(name, *p.bounds, log=p.log))
        return values

    def tell(self, rows: Sequence[Sequence[dict[str, Any]]]) -> None:
        """Report the results to Optuna.

        A variation with a failed run is a failed trial. A variation that exceeds a limit is an infeasible trial.
        """
        for trial, cases, excess in zip(self._trials, rows, self._excess, strict=True):
            for name, value in excess.items():
                trial.set_constraint(name, value)
            if any(value > 0 for value in excess.values()):
                self._asker.tell(trial, state=self._optuna.trial.TrialState.PRUNED)
                continue
            for m, limit in self._objective.limits.items():
                trial.set_constraint(m, max(row["metrics"].get(m, math.inf) - limit for row in cases))
            value = self._objective.score(cases)
            if math.isfinite(value):
                self._asker.tell(trial, value)
            else:
                self._asker.tell(trial, state=self._optuna.trial.TrialState.FAIL)


def sampler(study: Study) -> Fixed:
    """Create the sampler of a study.

    A MissingExtra is raised if the method needs Optuna and Optuna is not installed.
    """
    spec = study.spec
    if spec.method == "optuna":
        return Asked(study)
    names, parameters = list(study.parameters), list(study.parameters.values())
    if spec.method == "grid":
        axes = [
            p.values if p.values is not None else [p.at(k / max(p.steps - 1, 1)) for k in range(p.steps)]
            for p in parameters
        ]
        return Fixed([dict(zip(names, point, strict=True)) for point in itertools.product(*axes)])
    if spec.method == "random":
        return _at(study, np.random.default_rng(study.seed).random((spec.n, len(names))))
    from scipy.stats import qmc

    if spec.method == "sobol":
        engine: Any = qmc.Sobol(len(names), seed=study.seed)
        points = engine.random_base2(math.ceil(math.log2(spec.n)))[: spec.n]
    else:
        points = qmc.LatinHypercube(len(names), seed=study.seed).random(spec.n)
    return _at(study, points)


def _at(study: Study, points: Array) -> Fixed:
    """Return the variations for points in the unit cube, shape (n, parameters)."""
    parameters = study.parameters.items()
    return Fixed([{k: p.at(float(f)) for (k, p), f in zip(parameters, point, strict=True)} for point in points])
