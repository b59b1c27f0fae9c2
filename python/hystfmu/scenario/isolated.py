"""Foreign code runs in a process of its own, with limits of time and memory: it may crash, hang or grow without harm.

What comes back are two files of known form: nothing that the child writes is unpickled.
"""

from __future__ import annotations

import json
import pickle
import sys
import tempfile
from pathlib import Path

import numpy as np

from hystfmu import child
from hystfmu.scenario.run import Engine, simulate_here
from hystfmu.scenario.system import System
from hystfmu.scenario.trace import Stopped, Trace

GIGABYTES = 4.0
TASK, ENDED, VALUES = "task", "ended.json", "values"


def simulate_isolated(system: System, engine: Engine, seconds: float) -> Trace:
    """As `simulate`, in a child process.

    Raises
    ------
    Stopped
        Also when the child dies, or is not finished in time.
    """
    times = system.times()
    with tempfile.TemporaryDirectory(prefix="hystfmu-foreign-") as folder:
        (Path(folder) / TASK).write_bytes(pickle.dumps((system, engine)))
        process = child.start("-m", "hystfmu.scenario.isolated", folder)
        _, in_time = child.finish(process, seconds)
        if not in_time:
            raise Stopped(f"not finished after {seconds:g} s: a unit hangs, or allow more time")
        try:
            ended = json.loads((Path(folder) / ENDED).read_text())
            if ended["stopped"] is not None:
                raise Stopped(str(ended["stopped"]))
            shape = (len(times), system.n_values)
            values = np.fromfile(Path(folder) / VALUES, count=shape[0] * shape[1]).reshape(shape)
        except (OSError, ValueError, KeyError, TypeError):
            foreign = ", ".join(p.name for p in system.foreign)
            raise Stopped(f"the process that ran {foreign} ended with status {process.returncode}") from None
    return Trace(times, values, system.columns, system.case.ripple)


def main(folder: Path) -> None:
    """In the child: run the task in the folder and leave what became of it there."""
    task = (folder / TASK).read_bytes()  # our own parent wrote it
    child.limit_memory(GIGABYTES)
    stopped = None
    try:
        system, engine = pickle.loads(task)
        simulate_here(system, engine).values.tofile(folder / VALUES)
    except MemoryError:
        stopped = f"needs more than {GIGABYTES:g} GB of memory"
    except Exception as e:  # fmpy raises many kinds when a foreign FMU misbehaves
        words = str(e) if isinstance(e, Stopped) else f"{type(e).__name__}: {e}"
        stopped = " ".join(words.split())[:1000]
    (folder / ENDED).write_text(json.dumps({"stopped": stopped}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
