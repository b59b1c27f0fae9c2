"""Run a foreign SSP archive, and compare the result with the reference result in the archive."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError, meant
from hystfmu.scenario.engine.master import Engine
from hystfmu.scenario.engine.simulation import Run, chunks, silent
from hystfmu.scenario.outcome.trace import Excerpt, Stopped, Trace, row_file
from hystfmu.scenario.ssp.read import Ssp, read_ssp
from hystfmu.scenario.ssp.write import REFERENCE
from hystfmu.scenario.system.build import build
from hystfmu.scenario.system.case import Case, split_end
from hystfmu.scenario.system.spec import Scheme
from hystfmu.scenario.system.system import System


@dataclass(frozen=True)
class SspRun:
    """Result of a run of an archive.

    Attributes
    ----------
    path : path
    rows, outputs : int
        Numbers of rows and outputs; 0 if the run stopped.
    compared : tuple of str
        Signals that were compared with the reference result.
    faults : tuple of str
        One line for each signal that differs, or the reason why the run stopped.
    """

    path: str | Path
    rows: int
    outputs: int
    compared: tuple[str, ...]
    faults: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """True if the run ended and agrees with the reference result."""
        return not self.faults

    def lines(self) -> list[str]:
        """Return lines for the terminal."""
        if self.faults:
            return list(self.faults)
        told = (
            f"{len(self.compared)} signals agree with {REFERENCE}" if self.compared else "no reference to compare with"
        )
        return [f"{self.path}: {self.rows} rows of {self.outputs} outputs; {told}"]

    def summary(self) -> dict[str, Any]:
        """Return the facts of the run, for JSON."""
        facts = {"file": str(self.path), "passed": self.passed, "rows": self.rows, "outputs": self.outputs}
        return facts | {"compared": list(self.compared), "faults": list(self.faults)}


def _prepared(
    path: str | Path, coupling: Scheme | None, step: float | None, stop: float | None, settings: Mapping[str, Any]
) -> tuple[Ssp, Case, Array | None]:
    """Return archive, case and reference. The reference is None if it is for another coupling or other settings."""
    ssp = read_ssp(path, step, stop)
    if not settings and coupling in (None, ssp.case.coupling.scheme):
        return ssp, ssp.case, ssp.reference
    for name in settings:
        split_end(name, "--set")
    scheme = ssp.case.coupling.model_copy(update={"scheme": coupling} if coupling else {})
    return ssp, replace(ssp.case, coupling=scheme, overrides=dict(settings)), None


def _built(path: str | Path, case: Case) -> System:
    """Build the case. Errors name the files by their paths in the archive."""
    try:
        system = build(case)
    except InputError as e:
        raise InputError(str(e).replace(f"{case.folder}/", "")) from None
    if unknown := next((name for name in case.overrides if name not in system.overridden), None):
        names = sorted(system.parameters)
        raise InputError(f"{path}: --set {unknown}: No component has this parameter.{meant(unknown, names)}")
    return system


def _held_against(
    path: str | Path, case: Case, signals: tuple[str, ...], reference: Array | None, trace: Trace
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the compared signals, and a line for each that differs. The trace may be longer than the reference."""
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
    settings: Mapping[str, Any] | None = None,
) -> SspRun:
    """Run an archive, and compare it with its reference if there is one for this step and coupling.

    Rows are written to the file `out` during the run. The memory contains only the rows that the reference has.
    `progress` is called with the fraction done. `settings` override parameters, ``{"component.parameter": value}``.
    """
    ssp, case, reference = _prepared(path, coupling, step, stop, settings or {})
    system, run = _built(path, case), Run(engine, coupling, seconds, confined=confined)
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
        return SspRun(path, 0, 0, (), (f"{path}: stopped: {e}",))
    compared, lines = _held_against(path, case, ssp.signals, reference, begin.trace())
    return SspRun(path, system.n_steps + 1, len(system.columns), compared, lines)
