"""Running a case: in this process, or in one of its own if there is foreign code in it."""

from __future__ import annotations

from collections.abc import Iterator

from hystfmu.scenario.engine.fmu_store import FmuStore
from hystfmu.scenario.engine.master import Engine, chunks_here
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.system.system import System


def chunks(
    system: System, engine: Engine = "fmpy", store: FmuStore | None = None, seconds: float = 600.0
) -> Iterator[Trace]:
    """As `simulate` with the same `system`, `engine`, `store` and `seconds`, in chunks of consecutive rows.

    The memory does not grow with the length of the run.
    """
    if system.foreign:
        # here and not above: the child runs that file as its program
        from hystfmu.scenario.engine.isolated import chunks_isolated

        return chunks_isolated(system, engine, seconds)
    return chunks_here(system, engine, store)


def simulate(system: System, engine: Engine = "fmpy", store: FmuStore | None = None, seconds: float = 600.0) -> Trace:
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
        Longest time for a case with FMUs of others; they run in a child process.

    Raises
    ------
    InputError
        More values than fit into a memory.
    Stopped
        A unit refused an input or a step, or the sweeps of an iterative coupling do not agree; the message names it and
        the time.  The child process died or took too long.
    """
    return Trace.joined(chunks(system, engine, store, seconds), system.n_steps + 1)
