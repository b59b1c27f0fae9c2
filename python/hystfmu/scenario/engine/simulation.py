"""Run a case in this process, or in a child process if it has foreign FMUs."""

from __future__ import annotations

from collections.abc import Iterator

from hystfmu.scenario.engine.fmu_store import FmuStore
from hystfmu.scenario.engine.master import Engine, chunks_here
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.system.system import System


def chunks(
    system: System,
    engine: Engine = "fmpy",
    store: FmuStore | None = None,
    seconds: float = 600.0,
    confined: bool = True,
) -> Iterator[Trace]:
    """Run a case in chunks of consecutive rows, in memory that does not grow with its length.

    The parameters `system`, `engine`, `store`, `seconds` and `confined` are those of `simulate`.
    """
    if system.foreign:
        # here and not above: the child runs that file as its program
        from hystfmu.scenario.engine.isolated import chunks_isolated

        return chunks_isolated(system, engine, seconds, confined=confined)
    return chunks_here(system, engine, store)


def simulate(
    system: System,
    engine: Engine = "fmpy",
    store: FmuStore | None = None,
    seconds: float = 600.0,
    confined: bool = True,
) -> Trace:
    """Run a case from t = 0 to its end.

    Parameters
    ----------
    system : System
    engine : {"fmpy", "native"}
        "fmpy" simulates FMUs of the units (the reference), "native" the whole loop in the C core.  Both give the same
        bits.
    store : FmuStore, optional
        Where FMUs are unpacked; a temporary one by default.
    seconds : float
        Time limit of a case with foreign FMUs, which run in a child process.
    confined : bool
        Whether that process has no network and writes into a folder of its own only, where the system can.

    Raises
    ------
    InputError
        More values than a trace may hold.
    Stopped
        A unit refused an input or a step, the sweeps of an iterative coupling do not agree, or the child process died
        or exceeded the time limit.
    """
    return Trace.joined(chunks(system, engine, store, seconds, confined), system.n_steps + 1)
