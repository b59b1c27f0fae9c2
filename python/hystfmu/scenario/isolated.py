"""Foreign code runs in a process of its own, with limits of time and memory: it may crash, hang or grow without harm.

What comes back is bytes of known length: nothing that the child says is unpickled.
"""

from __future__ import annotations

import json
import multiprocessing as mp
from typing import Any

import numpy as np

from hystfmu.scenario.run import Engine, simulate_here
from hystfmu.scenario.system import System
from hystfmu.scenario.trace import Stopped, Trace

SECONDS, GIGABYTES = 600.0, 4.0
MOST_WORDS = 1 << 16


def limit_memory(gigabytes: float) -> None:
    """The largest address space of this process, where the system knows such a limit."""
    try:
        import resource

        most = int(gigabytes * 2**30)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    except (ImportError, ValueError, OSError):
        pass


def _child(pipe: Any, system: System, engine: Engine) -> None:
    limit_memory(GIGABYTES)
    try:
        trace = simulate_here(system, engine)
    except MemoryError:
        pipe.send_bytes(json.dumps({"stopped": f"needs more than {GIGABYTES:g} GB of memory"}).encode())
    except Exception as e:  # fmpy raises many kinds when a foreign FMU misbehaves
        words = str(e) if isinstance(e, Stopped) else f"{type(e).__name__}: {e}"
        pipe.send_bytes(json.dumps({"stopped": " ".join(words.split())[:1000]}).encode())
    else:
        pipe.send_bytes(json.dumps({}).encode())
        pipe.send_bytes(trace.values.tobytes())


def simulate_isolated(system: System, engine: Engine, seconds: float = SECONDS) -> Trace:
    """As `simulate`, in a child process.

    Raises
    ------
    Stopped
        Also when the child dies, or is not finished in time.
    """
    context = mp.get_context("spawn")
    pipe, theirs = context.Pipe(duplex=False)
    child = context.Process(target=_child, args=(theirs, system, engine), daemon=True)
    child.start()
    theirs.close()
    times = system.times()
    shape = (len(times), system.n_values)
    try:
        if not pipe.poll(seconds):
            raise Stopped(f"not finished after {seconds:g} s: a unit hangs, or allow more time")
        said = json.loads(pipe.recv_bytes(MOST_WORDS))
        if "stopped" in said:
            raise Stopped(str(said["stopped"]))
        values = np.frombuffer(pipe.recv_bytes(8 * shape[0] * shape[1])).reshape(shape)
    except (EOFError, OSError, ValueError):
        child.join(5)
        foreign = ", ".join(p.name for p in system.foreign)
        raise Stopped(f"the process that ran {foreign} ended with status {child.exitcode}") from None
    finally:
        pipe.close()
        child.kill()
        child.join()
    return Trace(times, values, system.columns, system.case.ripple)
