"""Closed-loop scenarios: read a scenario.toml, run its cases, hold them against limits and baseline, report."""

from __future__ import annotations

import difflib
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hystfmu.errors import InputError
from hystfmu.scenario.baseline import Baseline, Change, Kept, Record, changes, save_baseline
from hystfmu.scenario.case import Scenario, split_end
from hystfmu.scenario.events import missed
from hystfmu.scenario.excerpt import Picture
from hystfmu.scenario.fmu_store import FmuStore
from hystfmu.scenario.fused import to_graph
from hystfmu.scenario.metrics import Measure
from hystfmu.scenario.row_file import row_file
from hystfmu.scenario.run import Engine
from hystfmu.scenario.simulation import blocks, simulate
from hystfmu.scenario.spec import Scheme
from hystfmu.scenario.system import System, build
from hystfmu.scenario.trace import Stopped, Sweeps, Trace
from hystfmu.scenario.verdict import Verdict, judge

__all__ = [
    "Change",
    "Engine",
    "Result",
    "Scenario",
    "Trace",
    "Verdict",
    "blocks",
    "build",
    "run_scenarios",
    "simulate",
    "to_graph",
]


@dataclass(frozen=True)
class Result:
    """One case of a scenario after its run.

    Parameters
    ----------
    system : System
    verdicts : tuple of Verdict
        One per metric.
    lines : tuple of str
        One per failure: scenario/case, metric, value, limit.
    trace : Trace, optional
        The signals that the case names: recorded, in loops, in metrics.  All rows, or of a long run those that a
        picture needs (`simulate` gives all, `blocks` all in turn).  None when a unit refused to go on.
    seconds : float
        Time of the run.
    notes : tuple of str
        What a reader should know and is no failure: jumps between two steps.
    counted : Sweeps
        Of an iterative coupling.
    """

    system: System
    verdicts: tuple[Verdict, ...]
    lines: tuple[str, ...]
    trace: Trace | None
    seconds: float
    notes: tuple[str, ...] = ()
    counted: Sweeps = field(default_factory=Sweeps)

    @property
    def scenario(self) -> str:
        """Name of the scenario."""
        return self.system.case.scenario

    @property
    def case(self) -> str:
        """Name of the case."""
        return self.system.case.name

    @property
    def passed(self) -> bool:
        """All limits met and nothing changed against the baseline."""
        return not self.lines

    def failures(self) -> list[str]:
        """One line per failure."""
        return list(self.lines)

    @property
    def sweeps(self) -> dict[str, Any]:
        """Of an iterative coupling: method, mean and largest number of sweeps in a step; else empty."""
        s = self.counted
        if not s.steps:
            return {}
        method = "newton" if self.system.newton else "relaxation"
        return {"method": method, "mean": s.all / s.steps, "most": s.most}

    def summary(self) -> dict[str, Any]:
        """For machines: verdicts, failures, seconds; sweeps of an iterative coupling."""
        return {
            "scenario": self.scenario,
            "case": self.case,
            "passed": self.passed,
            "seconds": round(self.seconds, 4),
            "metrics": [vars(v) for v in self.verdicts],
            "failures": list(self.lines),
            "notes": list(self.notes),
        } | ({"sweeps": self.sweeps} if self.sweeps else {})


def run_scenarios(
    paths: Sequence[str | Path],
    *,
    record: bool = False,
    report_dir: str | Path | None = None,
    overrides: Mapping[str, Any] | None = None,
    progress: Callable[[float], None] = lambda fraction: None,
    engine: Engine = "fmpy",
    coupling: Scheme | None = None,
    seconds: float = 600.0,
    confirm: Callable[[list[Change]], bool] = lambda changes: True,
    case: str | None = None,
    out: str | Path | None = None,
) -> list[Result]:
    """Run scenarios with all their cases.

    Parameters
    ----------
    paths : sequence of path
        Folders that hold a scenario.toml, or the files themselves.
    record : bool
        Write baseline.toml and baseline.csv beside every scenario whose limits are all met.
    report_dir : path, optional
        Write report.html and report.json there.
    overrides : mapping, optional
        ``{"unit.parameter": value}``, in every case that has the unit; a string ``"*1.2"`` scales.
    progress : callable
        Called with the fraction that is done, 0..1.
    engine : {"fmpy", "python", "native"}
        See `simulate`; FMUs by fmpy are the reference.
    coupling : {"gauss_seidel", "jacobi", "iterative"}, optional
        Scheme for all cases instead of their own.
    seconds : float
        Longest time for a case with FMUs of others.
    confirm : callable
        With `record`: asked once, with what would change in the baselines, before anything is written.
    case : str, optional
        Run only the cases of this name.
    out : path, optional
        Write all outputs of the one case that runs there, as CSV; not if a unit refuses to go on.

    Returns
    -------
    list of Result
        In the order of the files and their cases.

    Raises
    ------
    InputError
        Bad scenario, model or override; before anything runs.
    """
    overrides = dict(overrides or {})
    if record and (overrides or coupling):
        raise InputError("--record stores the scenario as it is written: it takes neither --set nor --coupling")
    if record and case is not None:
        raise InputError("--record stores all cases of a scenario: it takes no --case")
    for key in overrides:
        split_end(key, "--set")
    scenarios = [Scenario(p, overrides, coupling) for p in paths]
    cases = [[c for c in s.cases if case in (None, c.name)] for s in scenarios]
    if not any(cases):
        names = dict.fromkeys(c.name for s in scenarios for c in s.cases)
        raise InputError(f"--case {case}: no such case; there are {', '.join(names)}")
    n = sum(map(len, cases))
    if out is not None and n > 1:
        raise InputError(f"-o {out}: one file holds one case, and {n} would run; name one with --case")
    systems = [[build(c) for c in group] for group in cases]
    for key in overrides:
        if not any(key in system.overridden for group in systems for system in group):
            known = {name for group in systems for system in group for name in system.parameters}
            near = " or ".join(difflib.get_close_matches(key, sorted(known), 2))
            raise InputError(
                f"--set {key}: none of the scenarios has a unit with that parameter{near and f'; did you mean {near}?'}"
            )
    baselines = [None if record else Baseline.load(s.folder) for s in scenarios]
    for system in (x for group in systems for x in group):
        if system.case.memory and system.foreign:
            raise InputError(
                f"{system.case.file}: memory: {system.foreign[0].name} is an FMU of others: its states are its own"
            )
    results: list[Result] = []
    written: list[tuple[Scenario, dict[str, Record]]] = []
    total = sum(system.n_steps for group in systems for system in group)
    done = 0
    for scenario, group, baseline in zip(scenarios, systems, baselines, strict=True):
        ran: list[Result] = []
        records: dict[str, Record] = {}
        with FmuStore() as store:
            for system in group:
                result, found = _run(system, baseline, engine, store, record, seconds, out)
                ran.append(result)
                if found is not None:
                    records[result.case] = found
                done += system.n_steps
                progress(done / total)
        if record and all(r.passed for r in ran):
            written.append((scenario, records))
        results += ran
    if written and confirm([c for s, runs in written for c in changes(s.spec.name, Baseline.load(s.folder), runs)]):
        for scenario, runs in written:
            save_baseline(scenario.folder, tuple(scenario.spec.record), runs)
    if report_dir is not None:
        from hystfmu.scenario.report import write_report

        write_report(results, report_dir)
    return results


def _run(
    system: System,
    baseline: Baseline | None,
    engine: Engine,
    store: FmuStore,
    record: bool,
    seconds: float,
    out: str | Path | None,
) -> tuple[Result, Record | None]:
    case, begin, notes = system.case, time.perf_counter(), tuple(missed(system))
    measured = {name: Measure(m) for name, m in case.metrics.items()}
    kept, picture = Kept(system, baseline), Picture(system)
    counted = Sweeps()
    adders: list[Callable[[Trace], None]] = [kept.add, picture.add, *(m.add for m in measured.values())]
    try:
        with ExitStack() as stack:
            if out is not None:
                adders.append(stack.enter_context(row_file(out, system)))
            for block in blocks(system, engine, store, seconds):
                for add in adders:
                    add(block)
                counted.add(block.sweeps)
    except Stopped as e:
        return Result(system, (), (f"{case.title}: stopped: {e}",), None, time.perf_counter() - begin, notes), None
    seconds = time.perf_counter() - begin
    verdicts, lines = judge(case, measured, kept, baseline, strict=not record)
    found = Record({v.metric: v.value for v in verdicts}, kept.rows(), kept.trace.memory)
    return Result(system, tuple(verdicts), tuple(lines), picture.trace(), seconds, notes, counted), found
