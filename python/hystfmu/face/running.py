"""`hystfmu.run` runs scenarios with all their cases, and compares the results with limits and baselines."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from hystfmu.base.calls import checked
from hystfmu.face.result import Results
from hystfmu.face.scenario import Scenario
from hystfmu.scenario import Change, Engine, Run, run_scenarios
from hystfmu.scenario.system.spec import Scheme

__all__ = ["run"]


@checked
def run(
    scenarios: str | Path | Scenario | Sequence[str | Path | Scenario],
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
    progress: Callable[[float], None] = lambda fraction: None,
    out: str | Path | None = None,
) -> Results:
    """Run scenarios with all their cases, and compare them with limits and baselines.

    Parameters
    ----------
    scenarios : path, Scenario, or several
        A path names a scenario.toml, or the folder with this file.
    case : str or sequence of str, optional
        Names of the cases to run; by default all cases run.
    engine : {"fmpy", "native"}
        "fmpy" simulates FMUs (the reference). "native" runs the whole loop in the C core. Both engines give the same
        bits.
    set : mapping, optional
        ``{"unit.parameter": value}`` for every case with this unit. A string ``"*1.2"`` is a factor.
    coupling : str, optional
        Coupling scheme for all cases; it replaces the schemes of the cases.
    seconds : float
        Time limit of a case with foreign FMUs (s).
    confined : bool
        Whether foreign FMUs run without network and with write access to a private folder only, if the system supports
        this.
    report : path, optional
        Folder for report.html and report.json.
    record : bool
        Whether to write the baseline of each scenario that meets all its limits.
    confirm : function, optional
        With `record`, called once with the changes before any file is written.
    progress : function, optional
        Called with the fraction done, 0..1.
    out : path, optional
        CSV file for all outputs, if a single case runs.

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
    several = [scenarios] if isinstance(scenarios, (str, Path, Scenario)) else scenarios
    return Results.of(
        run_scenarios(
            [s.ready() if isinstance(s, Scenario) else s for s in several],
            Run(engine, coupling, seconds, confined=confined, progress=progress),
            record=record,
            report_dir=report,
            overrides=set,
            confirm=confirm,
            case=case,
            out=out,
        )
    )
