"""One case: run it chunk by chunk, compute metrics, keep data for baseline and plots, test the limits."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from hystfmu.scenario.engine.fmu_store import FmuStore
from hystfmu.scenario.engine.master import Engine
from hystfmu.scenario.engine.simulation import chunks
from hystfmu.scenario.outcome.excerpt import Picture
from hystfmu.scenario.outcome.metrics import Measure
from hystfmu.scenario.outcome.row_file import row_file
from hystfmu.scenario.outcome.trace import Stopped, Sweeps, Trace
from hystfmu.scenario.system.events import missed
from hystfmu.scenario.system.system import System
from hystfmu.scenario.verdict.baseline import Baseline, Kept, Record
from hystfmu.scenario.verdict.judge import judge
from hystfmu.scenario.verdict.result import Result


def run_case(
    system: System,
    baseline: Baseline | None,
    engine: Engine,
    store: FmuStore,
    *,
    strict: bool = True,
    seconds: float = 600.0,
    confined: bool = True,
    out: str | Path | None = None,
    advance: Callable[[int], None] = lambda rows: None,
) -> tuple[Result, Record | None]:
    """Run a case and compare it with limits and baseline.

    Parameters
    ----------
    system, baseline, engine, store
        The case, its baseline, the engine, and the folder of unpacked FMUs.
    strict : bool
        A missing baseline, or a change from it, is a failure; otherwise only the limits are tested.
    seconds : float
        Longest time for a case with foreign FMUs.
    confined : bool
        Whether these run without network and write into a folder of their own only, where the system can.
    out : path, optional
        Write all outputs there, as CSV.
    advance : function
        Called with the number of rows since the last call; their sum is the number of rows of the case.

    Returns
    -------
    result : Result
    found : Record or None
        Data for a baseline; None if a unit stopped the run.
    """
    case, begin, notes = system.case, time.perf_counter(), tuple(missed(system))
    measured = {name: Measure(m) for name, m in case.metrics.items()}
    kept, picture, counted = Kept(system, baseline), Picture(system), Sweeps()
    left = system.n_steps + 1
    adders: list[Callable[[Trace], None]] = [kept.add, picture.add, *(m.add for m in measured.values())]
    try:
        with ExitStack() as stack:
            if out is not None:
                adders.append(stack.enter_context(row_file(out, system)))
            for chunk in chunks(system, engine, store, seconds, confined):
                for add in adders:
                    add(chunk)
                counted.add(chunk.sweeps)
                advance(len(chunk.t))
                left -= len(chunk.t)
    except Stopped as e:
        advance(left)
        return Result(system, (), (f"{case.title}: stopped: {e}",), None, time.perf_counter() - begin, notes), None
    took = time.perf_counter() - begin
    verdicts, lines, changed = judge(case, measured, kept, baseline, strict=strict)
    found = Record({v.metric: v.value for v in verdicts}, kept.rows(), kept.trace.final_states)
    return Result(system, tuple(verdicts), tuple(lines), picture.trace(), took, (*notes, *changed), counted), found
