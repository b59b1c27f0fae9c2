"""One foreign FMU runs alone in a child process, with inputs from a table.

The results are returned in two files of known format, which are untrusted. Nothing that the child writes is unpickled.
"""

from __future__ import annotations

import json
import pickle
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.child import Child, late, limit_memory
from hystfmu.base.confine import Box
from hystfmu.base.results import open_result, read_result
from hystfmu.fmu.foreign.finding import Ended, Finding
from hystfmu.fmu.foreign.instance import REAL
from hystfmu.fmu.foreign.simulated import Simulated
from hystfmu.scenario.engine.isolated import MOST_ENDED, one_line, without_result
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.foreign import Foreign, ForeignPort

GIGABYTES = 4.0
_TASK, _ENDED, _VALUES = "task", "ended.json", "values"
_CHUNK = 4096  # rows


@dataclass(frozen=True)
class Task:
    """Inputs of a run.  `signals` has a column per element of `driven`, at the times `t` (s)."""

    foreign: Foreign
    driven: tuple[ForeignPort, ...]
    t: Array
    signals: Array
    start: float
    step: float
    n_steps: int


def run_alone(task: Task, seconds: float, confined: bool = True) -> tuple[Array, Array, str]:
    """Run an FMU in a child process.

    Returns
    -------
    t : array, shape (n,)
        Times (s); fewer than the steps of the task if the FMU ends the simulation.
    values : array, shape (n, n_outputs)
        Its outputs.
    note : str
        Reason why it ended before the last step; "" if it did not.

    Raises
    ------
    Stopped
        The FMU refuses a call, dies, or exceeds the time limit.
    """
    with tempfile.TemporaryDirectory(prefix="hystfmu-alone-") as folder:
        (Path(folder) / _TASK).write_bytes(pickle.dumps(task))
        box = Box.of(folder, task.foreign.folder) if confined else None
        process = Child("-m", "hystfmu.scenario.engine.alone", folder, box=box)
        lines, in_time = process.finish(seconds)
        if not in_time:
            raise Stopped(late(seconds), "timeout")
        width = sum(p.size for p in task.foreign.ports if p.kind == "output")
        try:
            ended = json.loads(read_result(Path(folder) / _ENDED, MOST_ENDED))
            if ended["stopped"] is not None:
                raise Stopped(one_line(ended["stopped"]))
            rows = min(max(int(ended["rows"]), 0), task.n_steps + 1)
            with open_result(Path(folder) / _VALUES) as f:
                values = np.fromfile(f, count=rows * width).reshape(rows, width)
            t = np.asarray(task.start + np.arange(rows) * task.step, dtype=np.float64)
            return t, values, one_line(ended["note"])
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            raise without_result("the FMU", process, lines) from None


def _inputs(task: Task, times: Array) -> Array:
    """Inputs at the given times: continuous ones on the line between two rows, all others as in the row before."""
    columns = [p.variable for p in task.driven for _ in range(p.size)]
    found = np.empty((len(times), len(columns)))
    near = 1e-9 * task.step  # a row at a communication point counts, in spite of rounding
    before = np.maximum(np.searchsorted(task.t, times + near, side="right") - 1, 0)
    for k, v in enumerate(columns):
        held = v.type not in REAL or v.variability == "discrete"
        found[:, k] = task.signals[before, k] if held else np.interp(times, task.t, task.signals[:, k])
    return found


def _run(task: Task, folder: Path) -> tuple[int, str]:
    said: list[str] = []
    outputs = [(p.variable, p.size) for p in task.foreign.ports if p.kind == "output"]
    inputs = [(p.variable, p.size) for p in task.driven]
    rows = 0
    try:
        unit = Simulated(task.foreign.folder, task.foreign.description, inputs, outputs, "alone", said.append)
        unit.set_parameters(task.foreign.settings)
        with (folder / _VALUES).open("wb") as f:
            for first in range(0, task.n_steps + 1, _CHUNK):
                rows_here = np.arange(first, min(first + _CHUNK, task.n_steps + 1))
                times = np.asarray(task.start + rows_here * task.step, dtype=np.float64)
                table = _inputs(task, times).tolist()
                chunk = []
                for k, t in enumerate(times.tolist(), first):
                    if k:
                        unit.step(task.start + (k - 1) * task.step, task.step)
                        chunk.append(unit.get())
                        unit.put(table[k - first])
                    else:
                        unit.start(t, table[0])
                        chunk.append(unit.get())
                    rows += 1
                np.array(chunk, dtype=np.float64).tofile(f)
    except Ended as e:
        with (folder / _VALUES).open("ab") as f:
            np.array(chunk, dtype=np.float64).tofile(f)
        return rows, str(e)
    except Finding as e:
        raise Stopped(f"{e}{f' ({said[-1]})' if said else ''}") from None
    return rows, ""


def main(folder: Path) -> None:
    """In the child: run the task and write the result into the folder."""
    task: Task = pickle.loads((folder / _TASK).read_bytes())  # our own parent wrote it
    limit_memory(GIGABYTES)
    stopped, rows, note = None, 0, ""
    try:
        rows, note = _run(task, folder)
    except MemoryError:
        stopped = f"needs more than {GIGABYTES:g} GB of memory"
    except Exception as e:  # fmpy raises many kinds when a foreign FMU misbehaves
        words = str(e) if isinstance(e, Finding | Stopped) else f"{type(e).__name__}: {e}"
        stopped = one_line(words)
    (folder / _ENDED).write_text(json.dumps({"stopped": stopped, "rows": rows, "note": note}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
