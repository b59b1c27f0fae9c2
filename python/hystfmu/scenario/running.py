"""Run scenarios with all their cases: read, build, simulate, test, record the baseline, and report the results.

A case is simulated in chunks of rows. For each chunk, the metrics are updated, and rows for the baseline and the plots
are stored.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hystfmu.base import InputError, checked, escape, meant
from hystfmu.report.page import Table, table
from hystfmu.report.plot import Figure
from hystfmu.scenario.engine.member import FmuStore
from hystfmu.scenario.engine.simulation import Engine, Run, chunks, silent
from hystfmu.scenario.loop.opening import loop_figures
from hystfmu.scenario.outcome import result as outcome
from hystfmu.scenario.outcome.metrics import Measure
from hystfmu.scenario.outcome.result import Baseline, CaseResult, Change, Record
from hystfmu.scenario.outcome.trace import Picture, Stopped, Sweeps, Trace, row_file
from hystfmu.scenario.report.cases import case_plots
from hystfmu.scenario.report.page import write_report
from hystfmu.scenario.system.case import Case, Cases, ScenarioLike, split_end
from hystfmu.scenario.system.events import missed
from hystfmu.scenario.system.spec import Scheme, scenario_folders
from hystfmu.scenario.system.system import System, build

if TYPE_CHECKING:
    import pandas


class Result(CaseResult):
    """Result of one case of a scenario.

    `trace` contains the signals (``result.trace["plant.y"]``), and `verdicts` contains the metrics. `passed` is True if
    all limits are met and no metric differs from the baseline. `failures()` returns a line for each missed limit and
    each difference.

    Parameters
    ----------
    system : System
    verdicts : tuple of Verdict
        One verdict per metric.
    lines : tuple of str
        One line per failure: scenario/case, metric, value, limit.
    trace : Trace, optional
        Signals that the case records or uses in loops and metrics. For a long run, the trace contains only the rows for
        a plot. (`simulate` returns all rows, and `chunks` yields all rows in parts.) The trace is None if a unit
        stopped the run.
    seconds : float
        Duration of the run (s).
    notes : tuple of str
        Remarks on the run that are not failures, for example on discontinuities between two steps.
    counted : Sweeps
        Numbers of sweeps of an iterative coupling.
    loop : LoopFigures, optional
        Margins of the linearised loop of the case, or None if there are none.
    """

    def plot(self) -> Figure:
        """Plot hysteresis loops, recorded signals, and the error including the error between samples.

        Raises
        ------
        InputError
            A unit ended the run with an error, so there are no signals.
        """
        if self.trace is None:
            raise InputError(self.lines[0])
        return Figure(case_plots(self.system, self.trace))

    def report(self, folder: str | Path) -> Path:
        """Write report.html and report.json into `folder`, and return the path of report.html."""
        return Results([self]).report(folder)

    def _repr_html_(self) -> str:
        """Return HTML for a notebook."""
        return Results([self])._repr_html_()


class Results(list[Result]):
    """Results of several cases: a list of the results in `iterable`, in the order of the cases."""

    @property
    def passed(self) -> bool:
        """True if all cases have passed."""
        return all(r.passed for r in self)

    def report(self, folder: str | Path) -> Path:
        """Write report.html and report.json into `folder`, and return the path of report.html."""
        return write_report(self, folder)

    def to_pandas(self) -> pandas.DataFrame:
        """Return a data frame with a row for each metric: scenario, case, metric, value, limit, baseline, within.

        Signals of a case are in ``results[0].trace.to_pandas()``.

        Raises
        ------
        MissingExtra
            pandas is not installed.
        """
        from hystfmu.base import extras

        with extras("to_pandas()"):
            import pandas
        columns = ("metric", "value", "limit", "baseline", "within")
        rows = [(r.scenario, r.case, *(getattr(v, c) for c in columns)) for r in self for v in r.verdicts]
        return pandas.DataFrame(rows, columns=["scenario", "case", *columns])

    def __repr__(self) -> str:
        if len(self) <= 1:
            return f"Results([{', '.join(map(repr, self))}])"
        bad = [r.system.case.title for r in self if not r.passed]
        failed = f"; failed: {', '.join(bad[:3])}{', ...' if len(bad) > 3 else ''}" if bad else ""
        return f"Results({len(self)} cases, {len(self) - len(bad)} passed{failed})"

    def _repr_html_(self) -> str:
        """Return HTML for a notebook."""
        rows = [
            (r.scenario, r.case, v.metric, f"{v.value:.4g}", "" if v.limit is None else f"{v.limit:.4g}", _word(r))
            for r in self
            for v in r.verdicts
        ]
        rows += [(r.scenario, r.case, "", "", "", "stopped") for r in self if not r.verdicts]
        lines = "".join(f"<li>{escape(line)}</li>" for r in self for line in r.lines)
        head = ("scenario", "case", "metric", "value", "limit", "verdict")
        return table(Table(head, rows)) + (f"<ul>{lines}</ul>" if lines else "")


def _word(r: CaseResult) -> str:
    return "passed" if r.passed else "failed"


@dataclass(frozen=True)
class Plan:
    """One scenario: the cases to run, and the baseline, or None if there is no baseline to compare with.

    If `strict` is True, a change or a case without baseline is a failure. If it is False, only the limits are tested,
    because values are overridden or there is no baseline (first run, or scenario built in Python). If there is no
    baseline file, `note` states this.
    """

    scenario: Cases
    systems: tuple[System, ...]
    baseline: Baseline | None
    strict: bool
    note: str = ""


def read(
    paths: Sequence[str | Path | ScenarioLike], overrides: Mapping[str, Any], coupling: Scheme | None
) -> list[Cases]:
    """Read scenarios, and apply overrides and the coupling scheme. A folder may contain several scenarios."""
    for key in overrides:
        split_end(key, "--set")
    changes = dict(overrides)
    scenarios: list[Cases] = []
    for p in paths:
        if isinstance(p, (str, Path)):
            scenarios += [Cases(folder, changes, coupling) for folder in scenario_folders(Path(p))]
        else:
            scenarios.append(p.ready().changed(changes, coupling))
    return scenarios


def plan(
    scenarios: Sequence[Cases], case: str | Sequence[str] | None, overrides: Mapping[str, Any], record: bool
) -> list[Plan]:
    """Build the cases of the scenarios. Every invalid input raises an InputError here, before any case runs."""
    names = dict.fromkeys(c.name for s in scenarios for c in s.cases)
    wanted = (case,) if isinstance(case, str) else names if case is None else case
    if unknown := next((name for name in wanted if name not in names), None):
        raise InputError(f"--case {unknown}: no such case; there are {', '.join(names)}.{meant(unknown, names)}")
    cases = [[c for c in s.cases if c.name in wanted] for s in scenarios]
    if case is None:  # a case that the user names uses every override
        cases = [[_without_own(s, c) for c in group] for s, group in zip(scenarios, cases, strict=True)]
    built = [tuple(build(c) for c in group) for group in cases]
    _check_overrides(overrides, [s for group in built for s in group])
    strict = not overrides
    return [_plan(s, systems, record, strict) for s, systems in zip(scenarios, built, strict=True)]


def _plan(scenario: Cases, systems: tuple[System, ...], record: bool, strict: bool) -> Plan:
    if scenario.folder is None:
        return Plan(scenario, systems, None, strict=False)
    if record:  # a guard compares the new values with the old values
        return Plan(scenario, systems, Baseline.load(scenario.folder) if scenario.spec.guard else None, strict=False)
    baseline = Baseline.load(scenario.folder)
    if baseline is None and any(m.limit is not None for s in systems for m in s.case.metrics.values()):
        note = f"{scenario.spec.name}: no baseline: only the limits are tested; --record writes a baseline"
        return Plan(scenario, systems, None, strict=False, note=note)
    return Plan(scenario, systems, baseline, strict)


def _without_own(scenario: Cases, case: Case) -> Case:
    """Return the case without the overrides of parameters that the case itself sets. Overrides by a factor remain.

    For example, a case that disables the feedback still has no feedback.
    """
    own = {key for c in scenario.spec.case if c.name == case.name for key in c.set}
    relative = {k for k, v in case.overrides.items() if isinstance(v, str) and v.startswith("*")}
    return replace(case, overrides={k: v for k, v in case.overrides.items() if k not in own - relative})


def _check_overrides(overrides: Mapping[str, Any], systems: Sequence[System]) -> None:
    for key in overrides:
        if not any(key in system.overridden for system in systems):
            known = {name for system in systems for name in system.parameters}
            if key in known:
                raise InputError(
                    f"--set {key}: Every case sets this parameter itself. Use a factor such as '*1.2', or --case."
                )
            raise InputError(
                f"--set {key}: none of the scenarios has a unit with that parameter.{meant(key, sorted(known))}"
            )


def run_case(
    system: System, plan: Plan, run: Run, store: FmuStore, out: str | Path | None, advance: Callable[[int], None]
) -> tuple[Result, Record | None]:
    """Run a case, and return its result and the data for a new baseline. The data are None if the run stopped.

    If `out` is given, all outputs are written to this CSV file. The function `advance` is called with the number of
    rows since the last call.
    """
    case, begin, notes = system.case, time.perf_counter(), tuple(missed(system))
    measured = {name: Measure(m) for name, m in case.metrics.items()}
    kept, picture, counted = outcome.Kept(system, plan.baseline), Picture(system), Sweeps()
    left = system.n_steps + 1
    adders: list[Callable[[Trace], None]] = [kept.add, picture.add, *(m.add for m in measured.values())]
    try:
        with ExitStack() as stack:
            if out is not None:
                adders.append(stack.enter_context(row_file(out, system)))
            for chunk in chunks(system, run, store):
                for add in adders:
                    add(chunk)
                counted.add(chunk.sweeps)
                advance(len(chunk.t))
                left -= len(chunk.t)
    except Stopped as e:
        advance(left)
        return Result(system, (), (f"{case.title}: stopped: {e}",), None, time.perf_counter() - begin, notes), None
    took = time.perf_counter() - begin
    verdicts, lines, changed = outcome.judge(case, measured, kept, plan.baseline, plan.strict)
    found = Record({v.metric: v.value for v in verdicts}, kept.rows(), kept.trace.final_states)
    return Result(system, tuple(verdicts), tuple(lines), picture.trace(), took, (*notes, *changed), counted), found


@checked
def run(
    scenarios: str | Path | ScenarioLike | Sequence[str | Path | ScenarioLike],
    *,
    case: str | Sequence[str] | None = None,
    engine: Engine = "fmpy",
    set: Mapping[str, Any] | None = None,
    coupling: Scheme | None = None,
    seconds: float = 600.0,
    confined: bool = True,
    report: str | Path | None = None,
    record: bool = False,
    confirm: Callable[[list[Change]], bool] = lambda changes: True,
    progress: Callable[[float], None] = silent,
    out: str | Path | None = None,
) -> Results:
    """Run scenarios with all their cases, and compare them with limits and baselines.

    Parameters
    ----------
    scenarios : path, Scenario, or several
        A path names a scenario.toml, the folder with this file, or a folder of such folders.
    case : str or sequence of str, optional
        Name of a case to run. By default, all cases run.
    engine : {"fmpy", "native"}
        "fmpy" exports the units as FMUs and simulates them with fmpy. "native" runs the whole loop in the C core. The
        results of both engines are bit-identical.
    set : mapping, optional
        New values of parameters, named ``unit.parameter``. They apply in every case that contains the unit. A string
        such as ``"*1.2"`` multiplies the old value. With new values, only the limits determine the verdict, not the
        baseline. In a case that sets the parameter itself, the new value applies only if it is a factor such as
        ``"*1.2"``, or if `case` names this case.
    coupling : str, optional
        Coupling scheme. It replaces the coupling scheme that the scenario states.
    seconds : float in (0, inf)
        Time limit (s) of a simulation with foreign FMUs. Foreign FMUs run in a child process.
    confined : bool
        Whether foreign FMUs are confined: they have no access to the network and can write only to one private folder.
        Some operating systems do not offer this protection.
    report : path, optional
        Folder into which report.html and report.json are written.
    record : bool
        Whether to write the baseline of each scenario that meets all its limits. If a scenario states a factor
        ``guard``, no new metric may exceed ``guard`` times its value in the old baseline. To record larger values,
        delete the old baseline first.
    confirm : function, optional
        With `record`, called once with the changes before any file is written.
    progress : function, optional
        Called with the fraction done, 0..1.
    out : path, optional
        CSV file to write, with all outputs of the simulated case. Only one case may be simulated with this option.

    Returns
    -------
    Results
        Results in the order of the files and their cases.

    Raises
    ------
    InputError
        A scenario, a model or an override is invalid. The error occurs before any case runs.

    Examples
    --------
    >>> import hystfmu as hy
    >>> loop = hy.Scenario("sine", step=1e-4, stop=0.01)
    >>> loop = loop.add("source", hy.blocks.Reference(frequency=100.0)).metric("peak", "peak", "source.r")
    >>> hy.run(loop.case("once").case("twice", set={"source.amplitude": 2.0}), engine="native")
    Results(2 cases, 2 passed)
    """
    how, overrides = Run(engine, coupling, seconds, confined=confined, progress=progress), dict(set or {})
    several = scenarios if isinstance(scenarios, Sequence) and not isinstance(scenarios, str) else [scenarios]
    if record and (overrides or coupling):
        raise InputError("--record must not be combined with --set or --coupling")
    if record and case is not None:
        raise InputError("--record stores all cases of a scenario. It must not be combined with --case")
    plans = plan(read(several, overrides, coupling), case, overrides, record)
    if record and (unsaved := next((p.scenario for p in plans if p.scenario.folder is None), None)):
        raise InputError(f"{unsaved.origin}: A baseline is written beside a scenario.toml. Save the scenario first.")
    n = sum(len(p.systems) for p in plans)
    if out is not None and n > 1:
        raise InputError(f"-o {out}: one file contains one case, but {n} cases would run; select one with --case")
    advance = _share_done(plans, progress)
    results = Results()
    records: dict[int, dict[str, Record]] = {}
    for k, p in enumerate(plans):
        with FmuStore() as store:
            ran = []
            for system in p.systems:
                result, record_of = run_case(system, p, how, store, out, advance)
                told = [n for n in result.notes if not (record and outcome.CHANGED in n)]  # `confirm` shows the changes
                notes = (*told, *filter(None, [p.note]))
                ran.append((replace(result, loop=loop_figures(system), notes=notes), record_of))
        results += [r for r, _ in ran]
        if record and all(r.passed for r, _ in ran):
            records[k] = {r.case: found for r, found in ran if found is not None}
    _save([(plans[k], found) for k, found in records.items()], confirm)
    if report is not None:
        results.report(report)
    return results


def _share_done(plans: Sequence[Plan], progress: Callable[[float], None]) -> Callable[[int], None]:
    """Return a function that counts rows and reports the completed fraction."""
    total, done = sum(system.n_steps + 1 for p in plans for system in p.systems), 0

    def advance(rows: int) -> None:
        nonlocal done
        done += rows
        progress(done / total)

    return advance


def _save(recorded: Sequence[tuple[Plan, dict[str, Record]]], confirm: Callable[[list[Change]], bool]) -> None:
    """Write the new baselines if the changes are confirmed."""
    found = [(p.scenario.folder, p.scenario.spec, runs) for p, runs in recorded if p.scenario.folder is not None]
    if found and confirm([c for f, spec, runs in found for c in outcome.changes(spec.name, Baseline.load(f), runs)]):
        for folder, spec, runs in found:
            outcome.save_baseline(folder, tuple(spec.record), runs)
