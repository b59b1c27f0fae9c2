"""Run a case in this process, or in a child process with limits of time and memory if it has foreign FMUs.

A child may crash or hang without harm. Its results are returned in two files of known format, which are untrusted.
Nothing that it writes is unpickled.
"""

from __future__ import annotations

import json
import pickle
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from hystfmu.base.child import Child, late, limit_memory, open_result, read_result
from hystfmu.base.confine import CANNOT, Box
from hystfmu.fmu.foreign.instance import Finding
from hystfmu.scenario.engine.fmu_member import FmuStore
from hystfmu.scenario.engine.master import Engine, chunks_here
from hystfmu.scenario.outcome.trace import Stopped, Sweeps, Trace
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.spec import Scheme
from hystfmu.scenario.system.system import System

MOST_ENDED, MOST_WORDS = 2**16, 1000  # bytes, characters
TASK, ENDED, VALUES = "task", "ended.json", "values"
_PROGRAM = f"import sys; from {__name__} import main; main(sys.argv[1])"
Work = Callable[[Any, IO[bytes]], dict[str, Any]]
"""Function that a child runs. Its arguments are the task and the file for values; it returns all other results."""


def silent(fraction: float) -> None:
    """Ignore the fraction done."""


@dataclass(frozen=True)
class Run:
    """Options of a run of cases.

    Attributes
    ----------
    engine : {"fmpy", "native"}
        "fmpy" simulates FMUs of the units (the reference). "native" runs the whole loop in the C core. Both engines
        give the same bits.
    coupling : {"gauss_seidel", "jacobi", "iterative"}, optional
        Coupling scheme for all cases; it replaces the schemes of the cases.
    seconds, gigabytes : float
        Limits of time (s) and memory (GB) of a case with foreign FMUs. Such a case runs in a child process.
    confined : bool
        Whether the child process runs without network and with write access to a private folder only, if the system
        supports this.
    progress : function
        Called with the ``fraction`` done, 0..1.
    """

    engine: Engine = "fmpy"
    coupling: Scheme | None = None
    seconds: float = 600.0
    gigabytes: float = 4.0
    confined: bool = True
    progress: Callable[[float], None] = silent


def chunks(system: System, run: Run, store: FmuStore | None = None) -> Iterator[Trace]:
    """Run a case in chunks of consecutive rows. The memory does not grow with the length of the case.

    Parameters
    ----------
    system, run, store
        See `simulate`.
    """
    return chunks_isolated(system, run) if system.foreign else chunks_here(system, run.engine, store)


def simulate(system: System, engine: Engine = "fmpy", store: FmuStore | None = None, run: Run | None = None) -> Trace:
    """Run a case from t = 0 to its end. FMUs are unpacked in `store`; the default store is temporary.

    Parameters
    ----------
    system : System
    engine : {"fmpy", "native"}
    store : FmuStore, optional
    run : Run, optional
        Engine and limits.

    Raises
    ------
    InputError
        The run has more values than a trace may contain.
    Stopped
        A unit refused an input or a step, the sweeps of an iterative coupling did not converge, or the child process
        died or exceeded a limit.
    """
    return Trace.joined(chunks(system, run or Run(engine), store), system.n_steps + 1)


# ---- in a child process ---------------------------------------------------------------------------------------------
def one_line(words: object) -> str:
    """Return a message of foreign code as a line of bounded length."""
    return " ".join(str(words).split())[:MOST_WORDS]


def box_of(systems: Sequence[System], folder: str) -> Box:
    """Return the files that the foreign FMUs of these cases may use.

    These are their unpacked archives, and a folder for written files.
    """
    return Box.of(folder, *(p.graph.folder for s in systems for p in s.foreign if isinstance(p.graph, Foreign)))


@contextmanager
def child(
    work: Work, task: object, run: Run, foreign: Sequence[Foreign], names: str
) -> Iterator[tuple[dict[str, Any], IO[bytes]]]:
    """Do work in a child process. Yield the results at its end, and the file with its values.

    The work is a function of a module of this package. It reads the folders of the `foreign` FMUs; messages use `names`
    for them. Stopped is raised if the work stops, fails or has no valid result, or if the child dies or exceeds a
    limit.
    """
    with tempfile.TemporaryDirectory(prefix="hystfmu-foreign-") as folder:
        (Path(folder) / TASK).write_bytes(pickle.dumps((work, task, run.gigabytes)))
        box = Box.of(folder, *(f.folder for f in foreign)) if run.confined else None
        process = Child("-c", _PROGRAM, folder, box=box)
        lines, in_time = process.finish(run.seconds)
        if not in_time:
            raise Stopped(late(run.seconds), "timeout")
        try:
            ended = json.loads(read_result(Path(folder) / ENDED, MOST_ENDED))
            if ended["stopped"] is not None:
                raise Stopped(one_line(ended["stopped"]), str(ended["status"])[:20])
            with open_result(Path(folder) / VALUES) as f:
                yield ended, f
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            why = f" ({lines[-1]})" if process.status == CANNOT and lines else ""
            lacks = " without a result of its own" if process.status == 0 else ""
            raise Stopped(f"the process that ran {names} {process.ending}{lacks}{why}", "killed") from None


def main(folder: str) -> None:
    """Do the work in the child process, and write the result into the folder."""
    work, task, gigabytes = pickle.loads((Path(folder) / TASK).read_bytes())  # our own parent wrote it
    limit_memory(gigabytes)
    ended: dict[str, Any] = {"stopped": None, "status": "stopped"}
    try:
        with (Path(folder) / VALUES).open("wb") as f:
            ended |= work(task, f)
    except MemoryError:
        ended |= {"stopped": f"needs more than {gigabytes:g} GB of memory", "status": "memory"}
    except Exception as e:  # fmpy raises many kinds when a foreign FMU misbehaves
        ended["stopped"] = one_line(str(e) if isinstance(e, Finding | Stopped) else f"{type(e).__name__}: {e}")
    (Path(folder) / ENDED).write_text(json.dumps(ended))


def _case(task: tuple[System, Engine], file: IO[bytes]) -> dict[str, Any]:
    sweeps = Sweeps()
    for chunk in chunks_here(*task):
        chunk.values.tofile(file)
        sweeps.add(chunk.sweeps)
    return {"sweeps": [sweeps.all, sweeps.most, sweeps.steps]}


def chunks_isolated(system: System, run: Run) -> Iterator[Trace]:
    """Run in a child process, and return the chunks after the run ended without failure; for errors see `simulate`."""
    foreign = [p.graph for p in system.foreign if isinstance(p.graph, Foreign)]
    names = ", ".join(p.name for p in system.foreign)
    with child(_case, (system, run.engine), run, foreign, names) as (ended, f):
        for first, end in system.chunks():
            shape = (end - first, system.n_values)
            values = np.fromfile(f, count=shape[0] * shape[1]).reshape(shape)
            sweeps = Sweeps(*map(int, ended["sweeps"])) if end > system.n_steps else Sweeps()
            times = system.times(first, end)
            yield Trace(times, values, system.columns, system.case.ripple, first=first, sweeps=sweeps)
