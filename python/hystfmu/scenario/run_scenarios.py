"""Scenarios with all their cases: read -> build -> run -> test -> record -> report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from hystfmu.base.errors import InputError
from hystfmu.scenario.engine.fmu_store import FmuStore
from hystfmu.scenario.engine.master import Engine
from hystfmu.scenario.loop_figures import loop_figures
from hystfmu.scenario.plan import Plan, plan, read
from hystfmu.scenario.run_case import run_case
from hystfmu.scenario.system.case import Scenario
from hystfmu.scenario.system.spec import Scheme
from hystfmu.scenario.verdict.baseline import CHANGED, Baseline, Change, Record, changes, save_baseline
from hystfmu.scenario.verdict.result import Result


def run_scenarios(
    paths: Sequence[str | Path | Scenario],
    *,
    record: bool = False,
    report_dir: str | Path | None = None,
    overrides: Mapping[str, Any] | None = None,
    progress: Callable[[float], None] = lambda fraction: None,
    engine: Engine = "fmpy",
    coupling: Scheme | None = None,
    seconds: float = 600.0,
    confined: bool = True,
    confirm: Callable[[list[Change]], bool] = lambda changes: True,
    case: str | Sequence[str] | None = None,
    out: str | Path | None = None,
) -> list[Result]:
    """Run scenarios with all their cases.

    Parameters
    ----------
    paths : sequence of path or Scenario
        Folders that hold a scenario.toml, folders of these, the files themselves, or scenarios that were read or built.
    record : bool
        Write baseline.toml and baseline.csv beside every scenario whose limits are all met; a guard uses the old
        baseline, so a larger value is recorded only after this file is deleted.
    report_dir : path, optional
        Write report.html and report.json there.
    overrides : mapping, optional
        ``{"unit.parameter": value}``, in every case that has the unit; a string ``"*1.2"`` scales.
    progress : callable
        Called with the fraction that is done, 0..1.
    engine : {"fmpy", "native"}
        See `simulate`; FMUs by fmpy are the reference.
    coupling : {"gauss_seidel", "jacobi", "iterative"}, optional
        Scheme for all cases instead of their own.
    seconds : float
        Longest time for a case with foreign FMUs.
    confined : bool
        Whether these run without network and write into a folder of their own only, where the system can.
    confirm : callable
        With `record`: called once with the changes of the baselines before anything is written.
    case : str or sequence of str, optional
        Run only the cases of these names.
    out : path, optional
        Write all outputs of the one case that runs there, as CSV; not if a unit stops the run.

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
    plans = plan(read(paths, overrides, coupling), case, overrides, record)
    if record and (unsaved := next((p.scenario for p in plans if p.scenario.folder is None), None)):
        raise InputError(f"{unsaved.origin}: A baseline is written beside a scenario.toml. Save the scenario first.")
    n = sum(len(p.systems) for p in plans)
    if out is not None and n > 1:
        raise InputError(f"-o {out}: one file holds one case, and {n} would run; name one with --case")
    advance = _share_done(plans, progress)
    results: list[Result] = []
    records: dict[int, dict[str, Record]] = {}
    for k, p in enumerate(plans):
        with FmuStore() as store:
            ran = []
            for system in p.systems:
                limits: dict[str, Any] = {"seconds": seconds, "confined": confined}
                limits |= {"strict": p.strict, "advance": advance}
                result, record_of = run_case(system, p.baseline, engine, store, out=out, **limits)
                told = [n for n in result.notes if not (record and CHANGED in n)]  # `confirm` tells what changes
                notes = (*told, *filter(None, [p.note]))
                ran.append((replace(result, loop=loop_figures(system), notes=notes), record_of))
        results += [r for r, _ in ran]
        if record and all(r.passed for r, _ in ran):
            records[k] = {r.case: found for r, found in ran if found is not None}
    _save([(plans[k], found) for k, found in records.items()], confirm)
    if report_dir is not None:
        from hystfmu.scenario.report.page import write_report

        write_report(results, report_dir)
    return results


def _share_done(plans: Sequence[Plan], progress: Callable[[float], None]) -> Callable[[int], None]:
    """Report the fraction done, counted in rows."""
    total, done = sum(system.n_steps + 1 for p in plans for system in p.systems), 0

    def advance(rows: int) -> None:
        nonlocal done
        done += rows
        progress(done / total)

    return advance


def _save(recorded: Sequence[tuple[Plan, dict[str, Record]]], confirm: Callable[[list[Change]], bool]) -> None:
    """Write the new baselines, if there are any and the changes are confirmed."""
    found = [(p.scenario.folder, p.scenario.spec, runs) for p, runs in recorded if p.scenario.folder is not None]
    if found and confirm([c for f, spec, runs in found for c in changes(spec.name, Baseline.load(f), runs)]):
        for folder, spec, runs in found:
            save_baseline(folder, tuple(spec.record), runs)
