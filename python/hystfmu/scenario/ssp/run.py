"""Run a foreign SSP archive and compare it with the reference result in it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.scenario.engine.master import Engine
from hystfmu.scenario.engine.simulation import Run, chunks, silent
from hystfmu.scenario.outcome.trace import Excerpt, Stopped, Trace, row_file
from hystfmu.scenario.ssp.read import Ssp, read_ssp
from hystfmu.scenario.ssp.write import REFERENCE
from hystfmu.scenario.system.build import build
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.spec import Scheme
from hystfmu.scenario.system.system import System


def _prepared(
    path: str | Path, coupling: Scheme | None, step: float | None, stop: float | None
) -> tuple[Ssp, Case, Array | None]:
    """The archive, its case with this coupling, and the reference result if it belongs to that."""
    ssp = read_ssp(path, step, stop)
    if coupling in (None, ssp.case.coupling.scheme):
        return ssp, ssp.case, ssp.reference
    return ssp, replace(ssp.case, coupling=ssp.case.coupling.model_copy(update={"scheme": coupling})), None


def _built(case: Case) -> System:
    """Build the case; errors name files of the archive by their places in it."""
    try:
        return build(case)
    except InputError as e:
        raise InputError(str(e).replace(f"{case.folder}/", "")) from None


def _held_against(
    path: str | Path, case: Case, signals: tuple[str, ...], reference: Array | None, trace: Trace
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The signals that were compared, and one line for each that differs; the trace may end after the reference."""
    if reference is None:
        return (), ()
    rows = min(len(reference), len(trace.t))
    if np.abs(reference[:rows, 0] - trace.t[:rows]).max() > 1e-6 * case.step:
        return (), ()  # another step
    lines = []
    for k, end in enumerate(signals, 1):
        if end not in trace.columns:
            raise InputError(f"{path}: {REFERENCE}: names {end}, which does not exist")
        old, new = reference[:rows, k], trace[end][:rows]
        gap = np.abs(new - old)
        if not gap.max() <= case.tolerance * max(float(np.abs(old).max()), 1e-300):
            at = int(gap.argmax())
            lines.append(
                f"{path}: {end} = {new[at]:.9g} at t = {trace.t[at]:g} s differs from {old[at]:.9g} in "
                f"{REFERENCE} (tolerance {case.tolerance:g} of its largest value)"
            )
    return signals, tuple(lines)


def run_ssp(
    path: str | Path,
    engine: Engine = "fmpy",
    coupling: Scheme | None = None,
    step: float | None = None,
    stop: float | None = None,
    seconds: float = 600.0,
    out: str | Path | None = None,
    confined: bool = True,
    progress: Callable[[float], None] = silent,
) -> tuple[list[str], bool]:
    """Run an archive: the lines to print, and whether it agrees with the reference in it for this step and coupling.

    Rows go to the file `out` as they come, and no more of them are kept than the reference has.  `progress` is called
    with the fraction done.
    """
    ssp, case, reference = _prepared(path, coupling, step, stop)
    system, run = _built(case), Run(engine, coupling, seconds, confined=confined)
    begin = Excerpt(system.columns, np.arange(len(reference) if reference is not None else 1))
    try:
        with ExitStack() as stack:
            adders: list[Callable[[Trace], None]] = [begin.add]
            if out is not None:
                adders.append(stack.enter_context(row_file(out, system)))
            for chunk in chunks(system, run):
                for add in adders:
                    add(chunk)
                progress((chunk.first + len(chunk.t)) / (system.n_steps + 1))
    except Stopped as e:
        return [f"{path}: stopped: {e}"], False
    compared, lines = _held_against(path, case, ssp.signals, reference, begin.trace())
    if lines:
        return list(lines), False
    told = f"{len(compared)} signals agree with {REFERENCE}" if compared else "no reference to compare with"
    return [f"{path}: {system.n_steps + 1} rows of {len(system.columns)} outputs; {told}"], True
