"""Running an SSP archive of anybody, held against the reference result in it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hystfmu.csv_file import write_csv
from hystfmu.errors import InputError
from hystfmu.scenario.run import Engine
from hystfmu.scenario.simulation import simulate
from hystfmu.scenario.spec import Scheme
from hystfmu.scenario.ssp import REFERENCE
from hystfmu.scenario.ssp_file import read_ssp
from hystfmu.scenario.system import build
from hystfmu.scenario.trace import Stopped, Trace


@dataclass(frozen=True)
class SspRun:
    """What a run of an archive gave, and one line per signal that differs from the result in it."""

    trace: Trace
    compared: tuple[str, ...]
    lines: tuple[str, ...]


def run_ssp(
    path: str | Path,
    engine: Engine = "fmpy",
    coupling: Scheme | None = None,
    step: float | None = None,
    stop: float | None = None,
    seconds: float = 600.0,
) -> SspRun:
    """Run an SSP archive and hold it against the reference result in it, if there is one for this step and coupling.

    Raises
    ------
    InputError
        As `read_ssp`.
    Stopped
        As `simulate`.
    """
    ssp = read_ssp(path, step, stop)
    case, as_written = ssp.case, coupling in (None, ssp.case.coupling.scheme)
    if coupling is not None:
        case = replace(case, coupling=case.coupling.model_copy(update={"scheme": coupling}))
    trace = simulate(build(case), engine, seconds=seconds)
    if ssp.reference is None or not as_written:
        return SspRun(trace, (), ())
    rows = min(len(ssp.reference), len(trace.t))
    if np.abs(ssp.reference[:rows, 0] - trace.t[:rows]).max() > 1e-6 * case.step:
        return SspRun(trace, (), ())  # another step
    lines = []
    for k, end in enumerate(ssp.signals, 1):
        if end not in trace.columns:
            raise InputError(f"{path}: {REFERENCE}: names {end}, which does not exist")
        old, new = ssp.reference[:rows, k], trace[end][:rows]
        gap = np.abs(new - old)
        if not gap.max() <= case.tolerance * max(float(np.abs(old).max()), 1e-300):
            at = int(gap.argmax())
            lines.append(
                f"{path}: {end} = {new[at]:.9g} at t = {trace.t[at]:g} s differs from {old[at]:.9g} in "
                f"{REFERENCE} (tolerance {case.tolerance:g} of its largest value)"
            )
    return SspRun(trace, ssp.signals, tuple(lines))


def run_ssp_file(
    path: str,
    engine: Engine,
    coupling: Scheme | None,
    step: float | None,
    stop: float | None,
    seconds: float,
    out: str | None,
) -> tuple[list[str], bool]:
    """Run an archive for the command line: the lines to print, and whether it agrees with its reference."""
    try:
        run = run_ssp(path, engine, coupling, step, stop, seconds)
    except Stopped as e:
        return [f"{path}: stopped: {e}"], False
    names = list(run.trace.columns)
    if out is not None:
        write_csv(out, {"t": run.trace.t} | {n: run.trace[n] for n in names})
    if run.lines:
        return list(run.lines), False
    told = f"{len(run.compared)} signals agree with {REFERENCE}" if run.compared else "no reference to compare with"
    return [f"{path}: {len(run.trace.t)} rows of {len(names)} outputs; {told}"], True
