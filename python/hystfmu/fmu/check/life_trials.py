"""Trials of state and memory of an instance in Co-Simulation: reset, saved states, memory leaks, repeated loading."""

from __future__ import annotations

import contextlib
import ctypes as C
import gc
import time
from collections.abc import Iterator
from pathlib import Path

from hystfmu.fmu.check.foreign_library import STEPS, ForeignFmu
from hystfmu.fmu.foreign.instance import REAL, Finding, Instance

_LEAK, _LEAST_GROWTH = 32, 1 << 20  # bytes per step; total bytes above the noise of the allocator


def reset(fmu: ForeignFmu) -> Iterator[str]:
    """After reset the run equals the run of a new instance."""
    with fmu.running() as made:
        want = fmu.run(made, range(fmu.steps // 2))
        made.call("reset", "reset")
        made.initialize(fmu.t0)
        made.begin()
        if where := fmu.difference(want, fmu.run(made, range(fmu.steps // 2))):
            yield f"after reset the run differs from that of a new instance: {where}"
    if fmu.version > 1:
        yield from _reset_parameters(fmu)


def _reset_parameters(fmu: ForeignFmu) -> Iterator[str]:
    """Reset restores the start values of parameters and inputs, as in a new instance."""
    kept = [v for v in fmu.variables if v.type in REAL and v.causality in ("parameter", "input") and v.start]
    with fmu.readable() as made:
        starts = [made.get(v) for v in kept]
    made = Instance(fmu.folder, fmu.description, "CoSimulation")
    try:
        for v in kept:
            low, high = (None if b is None else float(b) for b in (v.min, v.max))
            other = [x / 2 + 0.125 for x in fmu.start(v)]
            if any((low is not None and x < low) or (high is not None and x > high) for x in other):
                continue
            with contextlib.suppress(Finding):  # it may refuse a value that its description does not forbid
                made.set(v, other)
        made.call("reset", "reset")
        made.initialize(fmu.t0)
        for v, start in zip(kept, starts, strict=True):
            if made.get(v) != start:
                yield f"after reset {v.name} is {made.get(v)[0]!r} instead of its start value {start[0]!r}"
    finally:
        made.free()


def null_pointers(fmu: ForeignFmu) -> Iterator[str]:
    """Freeing NULL is ignored, and a freed state is NULL afterwards."""
    if fmu.version == 1:
        return
    name, spelling = f"fmi{fmu.version}", "FMUstate" if fmu.version == 2 else "FMUState"
    with fmu.running() as made:
        free = made.unit.dll[f"{name}FreeInstance"]
        free.argtypes, free.restype = [C.c_void_p], None
        free(None)
        if not fmu.description.coSimulation.canGetAndSetFMUstate:
            return
        none = C.c_void_p()
        release = made.unit.dll[f"{name}Free{spelling}"]
        release.argtypes, release.restype = [C.c_void_p, C.POINTER(C.c_void_p)], C.c_int
        release(made.unit.component, C.byref(none))
        state = C.c_void_p(made.call("saving the state", f"get{spelling}").value)
        release(made.unit.component, C.byref(state))
        if state.value is not None:
            yield f"{name}Free{spelling} does not set the pointer to NULL"


def saved_states(fmu: ForeignFmu) -> Iterator[str]:
    """A run continues with equal bits from a restored state, repeatedly, and from a deserialized state."""
    can = fmu.description.coSimulation
    if fmu.version == 1 or not can.canGetAndSetFMUstate:
        return
    half, rest = range(fmu.steps // 2), range(fmu.steps // 2, fmu.steps)
    fmi2 = fmu.version == 2
    spelling = "FMUstate" if fmi2 else "FMUState"
    with fmu.running() as made:
        fmu.run(made, half)
        state = made.call("saving the state", f"get{spelling}")
        want = fmu.run(made, rest)
        for times in ("", " a second time"):
            made.call("restoring the state", f"set{spelling}", state)
            if where := fmu.difference(want, fmu.run(made, rest), half.stop):
                yield f"after restoring a saved state{times} the run differs: {where}"
                return
        if can.canSerializeFMUstate:
            content = made.call("serializing the state", f"serialize{spelling}", state)
            load = "deSerializeFMUstate" if fmi2 else "deserializeFMUState"
            loaded = made.call("deserializing the state", load, content)
            made.call("restoring the deserialized state", f"set{spelling}", loaded)
            if where := fmu.difference(want, fmu.run(made, rest), half.stop):
                yield f"after restoring a deserialized state the run differs: {where}"
            made.call("freeing a state", f"free{spelling}", loaded)
        made.call("freeing a state", f"free{spelling}", state)


def _resident() -> int:
    """Return the resident memory of this process in bytes, 0 if it cannot be read."""
    statm = Path("/proc/self/statm")
    return int(statm.read_text().split()[1]) * 4096 if statm.exists() else 0


def leaks(fmu: ForeignFmu, most: int = 20_000) -> Iterator[str]:
    """Memory does not grow with the number of steps."""
    end, done, warm, before = time.monotonic() + fmu.seconds, 0, most // 10, 0
    once = most if fmu.steps == STEPS else max(fmu.steps, 1)
    with fmu.running() as made:
        while done < most and time.monotonic() < end:
            if done and done % once == 0:  # an FMU that ends the simulation starts again
                made.call("reset", "reset")
                made.initialize(fmu.t0)
                made.begin()
            fmu.step(made, done % once)
            done += 1
            if done == warm:
                gc.collect()
                before = _resident()
        gc.collect()
        growth = _resident() - before
    if done > warm and growth > max(_LEAST_GROWTH, _LEAK * (done - warm)):
        yield f"memory grows by {growth / (done - warm):.0f} bytes per step (over {done - warm} steps)"


def loading(fmu: ForeignFmu) -> Iterator[str]:
    """Repeated loading and unloading gives equal runs without a memory leak."""
    runs, before = [], 0
    for cycle in range(20):
        with fmu.running() as made:
            runs.append(fmu.run(made, range(min(fmu.steps, 5))))
        if cycle == 4:
            before = _resident()
    for cycle, run in enumerate(runs):
        if where := fmu.difference(runs[0], run):
            yield f"after loading the binary {cycle + 1} times the run differs: {where}"
            return
    growth = _resident() - before
    if growth > 4 * _LEAST_GROWTH:
        yield f"memory grows by {growth // 15} bytes with every load and unload"
