"""Foreign FMUs run in a child process with limits of time and memory, where they may crash or hang without harm.

The results are returned in two files of known format, which are untrusted. Nothing that the child writes is unpickled.
"""

from __future__ import annotations

import json
import pickle
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from hystfmu.base.child import Child, late, limit_memory
from hystfmu.base.confine import CANNOT, Box
from hystfmu.base.results import open_result, read_result
from hystfmu.scenario.engine.master import Engine, chunks_here
from hystfmu.scenario.outcome.trace import Stopped, Sweeps, Trace
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import System

GIGABYTES = 4.0
MOST_ENDED, MOST_WORDS = 2**16, 1000  # bytes, characters
TASK, ENDED, VALUES = "task", "ended.json", "values"


def one_line(words: object) -> str:
    """Return a message of foreign code as a line of bounded length."""
    return " ".join(str(words).split())[:MOST_WORDS]


def box_of(systems: Sequence[System], folder: str) -> Box:
    """Return the files that the foreign FMUs of these cases may use: their unpacked archives, and a folder to write
    into."""
    return Box.of(folder, *(p.graph.folder for s in systems for p in s.foreign if isinstance(p.graph, Foreign)))


def without_result(foreign: str, child: Child, lines: list[str]) -> Stopped:
    """Return the reason why a child process left no valid result; `lines` is its output."""
    why = f" ({lines[-1]})" if child.status == CANNOT and lines else ""
    lacks = " without a result of its own" if child.status == 0 else ""
    return Stopped(f"the process that ran {foreign} {child.ending}{lacks}{why}", "killed")


def chunks_isolated(
    system: System, engine: Engine, seconds: float, gigabytes: float = GIGABYTES, confined: bool = True
) -> Iterator[Trace]:
    """Return the chunks of a run in a child process, after it has ended without failure.

    Raises
    ------
    Stopped
        As `chunks`; the child dies or exceeds the time limit.
    """
    with tempfile.TemporaryDirectory(prefix="hystfmu-foreign-") as folder:
        (Path(folder) / TASK).write_bytes(pickle.dumps((system, engine, gigabytes)))
        box = box_of([system], folder) if confined else None
        child = Child("-m", "hystfmu.scenario.engine.isolated", folder, box=box)
        lines, in_time = child.finish(seconds)
        if not in_time:
            raise Stopped(late(seconds), "timeout")
        try:
            ended = json.loads(read_result(Path(folder) / ENDED, MOST_ENDED))
            if ended["stopped"] is not None:
                raise Stopped(one_line(ended["stopped"]), str(ended["status"])[:20])
            with open_result(Path(folder) / VALUES) as f:
                for first, end in system.chunks():
                    shape = (end - first, system.n_values)
                    values = np.fromfile(f, count=shape[0] * shape[1]).reshape(shape)
                    times = system.times(first, end)
                    sweeps = Sweeps(*map(int, ended["sweeps"])) if end > system.n_steps else Sweeps()
                    yield Trace(times, values, system.columns, system.case.ripple, first=first, sweeps=sweeps)
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            raise without_result(", ".join(p.name for p in system.foreign), child, lines) from None


def main(folder: Path) -> None:
    """In the child: run the task and write the result into the folder."""
    task = (folder / TASK).read_bytes()  # our own parent wrote it
    stopped, status, sweeps = None, "stopped", Sweeps()
    system, engine, gigabytes = pickle.loads(task)
    limit_memory(gigabytes)
    try:
        with (folder / VALUES).open("wb") as f:
            for chunk in chunks_here(system, engine):
                chunk.values.tofile(f)
                sweeps.add(chunk.sweeps)
    except MemoryError:
        stopped, status = f"needs more than {gigabytes:g} GB of memory", "memory"
    except Exception as e:  # fmpy raises many kinds when a foreign FMU misbehaves
        words = str(e) if isinstance(e, Stopped) else f"{type(e).__name__}: {e}"
        stopped = one_line(words)
    counted = [sweeps.all, sweeps.most, sweeps.steps]
    (folder / ENDED).write_text(json.dumps({"stopped": stopped, "status": status, "sweeps": counted}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
