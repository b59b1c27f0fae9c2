"""Simulate a case. A case with foreign FMUs runs in a child process with limits of time and memory.

The child process may crash or hang without harm to this process. It returns the results in two files of a known format.
These files are untrusted, so they are never unpickled.

There are two engines. With the engine "fmpy", every unit is a real FMU, which fmpy loads and initialises. With the
engine "native", the units are graphs of the core. One master loop in C, `fmu_build/master`, steps the units of both
engines, so that grid, coupling and values are the same and the results are bit-identical.
"""

import json
import pickle
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Literal, get_args

import numpy as np

from hystfmu.base import InputError
from hystfmu.base.child import Child, late, limit_memory, open_result, read_result
from hystfmu.base.confine import CANNOT, Box
from hystfmu.fmu.foreign.instance import Finding
from hystfmu.scenario.engine.member import FmuStore
from hystfmu.scenario.engine.native import Native
from hystfmu.scenario.outcome.trace import Stopped, Sweeps, Trace
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.spec import Scheme
from hystfmu.scenario.system.system import System

Engine = Literal["fmpy", "native"]
ENGINES: tuple[Engine, ...] = get_args(Engine)


def chunks_here(system: System, engine: Engine = "fmpy", store: FmuStore | None = None) -> Iterator[Trace]:
    """Simulate a case in this process, including foreign FMUs, and yield chunks of rows.

    Stopped is raised if a unit refuses an input or a step, or if the sweeps of an iterative coupling do not converge.
    """
    if engine not in ENGINES:
        raise InputError(f"engine: must be one of {', '.join(ENGINES)}. Got {engine!r} instead.")
    with ExitStack() as stack:
        if engine == "fmpy":
            store = store or stack.enter_context(FmuStore())
        yield from Native(system, store=store if engine == "fmpy" else None).chunks()


MOST_ENDED, MOST_WORDS = 2**16, 1000  # limits of the result file (bytes) and of a message (characters)
TASK, ENDED, VALUES = "task", "ended.json", "values"
_PROGRAM = f"import sys; from {__name__} import main; main(sys.argv[1])"
Work = Callable[[Any, IO[bytes]], dict[str, Any]]
"""Function that a child runs. Its arguments are the task and the file for values; it returns all other results."""


def silent(fraction: float) -> None:
    """Do nothing. This is the default function for progress, which ignores the completed `fraction`."""


@dataclass(frozen=True)
class Run:
    """Options for the simulation of cases.

    Attributes
    ----------
    engine : {"fmpy", "native"}
        "fmpy" simulates the FMUs of the units, which fmpy loads. "native" runs the whole loop in the C core. Their
        results are bit-identical.
    coupling : {"gauss_seidel", "jacobi", "iterative"}, optional
        Coupling scheme for all cases; it replaces the schemes of the cases.
    seconds, gigabytes : float
        Limits of time (s) and memory (GB) of a case with foreign FMUs. Such a case runs in a child process.
    confined : bool
        Whether the child process runs without network and with write access to a private folder only, if the system
        supports this.
    progress : function
        Function that is called with the completed fraction of the work, 0 to 1.
    """

    engine: Engine = "fmpy"
    coupling: Scheme | None = None
    seconds: float = 600.0
    gigabytes: float = 4.0
    confined: bool = True
    progress: Callable[[float], None] = silent


def chunks(system: System, run: Run, store: FmuStore | None = None) -> Iterator[Trace]:
    """Simulate a case, and yield chunks of consecutive rows. The memory does not grow with the number of rows.

    Parameters
    ----------
    system, run, store
        See `simulate`.
    """
    return chunks_isolated(system, run) if system.foreign else chunks_here(system, run.engine, store)


def simulate(system: System, engine: Engine = "fmpy", store: FmuStore | None = None, run: Run | None = None) -> Trace:
    """Simulate the case `system` from t = 0 to the end, and return the trace of all outputs.

    `engine` is "fmpy" or "native". If the settings `run` are given, the engine of these settings is used instead. FMUs
    are unpacked into `store`, by default into a temporary folder. An InputError is raised if the run has more values
    than a trace may contain. `Stopped` is raised if a unit refused an input or a step, the sweeps of an iterative
    coupling did not converge, or the child process died or exceeded a limit.
    """
    return Trace.joined(chunks(system, run or Run(engine), store), system.n_steps + 1)


# ---- in a child process ---------------------------------------------------------------------------------------------
def one_line(words: object) -> str:
    """Return a message of foreign code as one line of limited length."""
    return " ".join(str(words).split())[:MOST_WORDS]


def box_of(systems: Sequence[System], folder: str) -> Box:
    """Return the files that the foreign FMUs of these cases may use.

    The files are the unpacked archives, and a folder in which the FMUs may write.
    """
    return Box.of(folder, *(p.graph.folder for s in systems for p in s.foreign if isinstance(p.graph, Foreign)))


@contextmanager
def child(
    work: Work, task: object, run: Run, foreign: Sequence[Foreign], names: str
) -> Iterator[tuple[dict[str, Any], IO[bytes]]]:
    """Call ``work(task, file)`` in a child process. At the end, yield the results and the file with the values.

    The function `work` must be in a module of this package. It may read the folders of the `foreign` FMUs. `run`
    contains the limits of time and memory. `names` is the name of the FMUs in error messages. Stopped is raised if the
    function stops, fails or has no valid result, or if the child process dies or exceeds a limit.
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
    """Read a function and its task from `folder`, call the function, and write the result there.

    The child process calls `main`.
    """
    # the parent process wrote this file, so it is trusted
    work, task, gigabytes = pickle.loads((Path(folder) / TASK).read_bytes())
    limit_memory(gigabytes)
    ended: dict[str, Any] = {"stopped": None, "status": "stopped"}
    try:
        with (Path(folder) / VALUES).open("wb") as f:
            ended |= work(task, f)
    except MemoryError:
        ended |= {"stopped": f"needs more than {gigabytes:g} GB of memory", "status": "memory"}
    except Exception as e:  # fmpy raises many kinds of exceptions for a faulty foreign FMU
        ended["stopped"] = one_line(str(e) if isinstance(e, Finding | Stopped) else f"{type(e).__name__}: {e}")
    (Path(folder) / ENDED).write_text(json.dumps(ended))


def _case(task: tuple[System, Engine], file: IO[bytes]) -> dict[str, Any]:
    sweeps = Sweeps()
    for chunk in chunks_here(*task):
        chunk.values.tofile(file)
        sweeps.add(chunk.sweeps)
    return {"sweeps": [sweeps.all, sweeps.most, sweeps.steps]}


def chunks_isolated(system: System, run: Run) -> Iterator[Trace]:
    """Simulate a case in a child process, and yield the chunks after the end of the run. Errors: see `simulate`."""
    foreign = [p.graph for p in system.foreign if isinstance(p.graph, Foreign)]
    names = ", ".join(p.name for p in system.foreign)
    with child(_case, (system, run.engine), run, foreign, names) as (ended, f):
        for first, end in system.chunks():
            shape = (end - first, system.n_values)
            values = np.fromfile(f, count=shape[0] * shape[1]).reshape(shape)
            sweeps = Sweeps(*map(int, ended["sweeps"])) if end > system.n_steps else Sweeps()
            times = system.times(first, end)
            yield Trace(times, values, system.columns, system.case.ripple, first=first, sweeps=sweeps)
