"""`hystfmu.run`: scenarios of files and of Python with all their cases, against limits and baselines."""

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
        A path is that of a scenario.toml or of the folder that holds it.
    case : str or sequence of str, optional
        Run only the cases of these names.
    engine : {"fmpy", "native"}
        FMUs by fmpy (the reference), or the whole loop in the C core; both give the same bits.
    set : mapping, optional
        ``{"unit.parameter": value}`` in every case that has the unit; a string ``"*1.2"`` scales.
    coupling : str, optional
        Scheme for all cases instead of their own.
    seconds : float
        Longest time of a case with foreign FMUs.
    confined : bool
        Whether these run without network and write into a folder of their own only, where the system can.
    report : path, optional
        Write report.html and report.json into this folder.
    record : bool
        Write baselines for the scenarios whose limits are all met.
    confirm : function, optional
        With `record`: called once with the changes before anything is written.
    progress : function, optional
        Called with the fraction done, 0..1.
    out : path, optional
        Write all outputs of the one case that runs there, as CSV.

    Raises
    ------
    InputError
        Bad scenario, model or override; before anything runs.

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
