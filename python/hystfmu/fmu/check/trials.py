"""Trials of a foreign FMU in Co-Simulation. Every trial checks one property and yields its findings as sentences.

The trials search for defects that occur in published FMUs. Examples are states that change when an output is read,
memory leaks in every step, global variables shared by instances, and an incomplete reset. Results of equal runs must be
bit-identical.
"""

import contextlib
import ctypes as C
import gc
import math
import struct
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from hystfmu.fmu.check.foreign_library import MADE, STEPS, ForeignFmu, Trial, bounds, making, tangent_differs
from hystfmu.fmu.foreign.instance import REAL, Finding, Instance, Values, count

_LEAK, _LEAST_GROWTH = 32, 1 << 20  # growth of memory that counts as a leak: bytes per step, and total bytes


def reset(fmu: ForeignFmu) -> Iterator[str]:
    """Check that a run after reset equals the run of a new instance."""
    with fmu.running() as made:
        want = fmu.run(made, range(fmu.steps // 2))
        made.restart(fmu.t0)
        if where := fmu.difference(want, fmu.run(made, range(fmu.steps // 2))):
            yield f"after reset the run differs from that of a new instance: {where}"
    if fmu.version > 1:
        yield from _reset_parameters(fmu)


def _reset_parameters(fmu: ForeignFmu) -> Iterator[str]:
    """Check that reset restores the start values of parameters and inputs."""
    kept = [v for v in fmu.variables if v.type in REAL and v.causality in ("parameter", "input") and v.start]
    with fmu.readable() as made:
        starts = [made.get(v) for v in kept]
    made = Instance(fmu.folder, fmu.description, "CoSimulation")
    try:
        for v in kept:
            low, high = bounds(v)
            other = [x / 2 + 0.125 for x in fmu.start(v)]
            if any((low is not None and x < low) or (high is not None and x > high) for x in other):
                continue
            with contextlib.suppress(Finding):  # the FMU may refuse a value although its description permits it
                made.set(v, other)
        made.call("reset", "reset")
        made.initialize(fmu.t0)
        for v, start in zip(kept, starts, strict=True):
            if made.get(v) != start:
                yield f"after reset {v.name} is {made.get(v)[0]!r} instead of its start value {start[0]!r}"
    finally:
        made.free()


def null_pointers(fmu: ForeignFmu) -> Iterator[str]:
    """Check that the FMU ignores a call that frees NULL, and that the pointer to a freed state is NULL."""
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
    """Check that a run continues bit-identically after a saved state is restored twice and after deserialisation."""
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
    """Return the resident memory of this process in bytes; 0 if it is not known."""
    statm = Path("/proc/self/statm")
    return int(statm.read_text().split()[1]) * 4096 if statm.exists() else 0


def leaks(fmu: ForeignFmu, most: int = 20_000) -> Iterator[str]:
    """Check that the memory does not grow with the number of steps.

    A quarter of the steps is enough if the memory has grown by less than one byte per step.
    """
    end, done, warm, before = time.monotonic() + fmu.seconds, 0, most // 10, 0
    once = most if fmu.steps == STEPS else max(fmu.steps, 1)
    with fmu.running() as made:
        while done < most and time.monotonic() < end:
            if done and done % once == 0:  # if the FMU ends the simulation, it starts again
                made.restart(fmu.t0)
            fmu.step(made, done % once)
            done += 1
            if done == warm:
                gc.collect()
                before = _resident()
            if done == most // 4:
                gc.collect()
                if _resident() - before < done - warm:
                    return
        gc.collect()
        growth = _resident() - before
    if done > warm and growth > max(_LEAST_GROWTH, _LEAK * (done - warm)):
        yield f"memory grows by {growth / (done - warm):.0f} bytes per step (over {done - warm} steps)"


def loading(fmu: ForeignFmu) -> Iterator[str]:
    """Check that runs are equal, and that the memory does not grow, if the binary is loaded repeatedly."""
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


_SMALL = 1e-4  # fraction of a step in which direct feed-through has its full effect, but states hardly change
_MOST_PAIRS = 64
STEPPED = f"making {STEPS} steps"


def start_values(fmu: ForeignFmu) -> Iterator[str]:
    """Check that all variables can be read, and that values agree with the model description or with the values set."""
    with fmu.readable() as made:
        for v in fmu.variables:
            if getattr(v, "clocks", None):
                continue
            read = made.get(v)
            if v.causality in ("input", "parameter", "structuralParameter") and v.start is not None:
                start = _stored(v, fmu.start(v))
                if read != start:
                    shown = read[0] if len(read) == 1 else list(read)
                    yield f"{v.name}: the start value is {v.start}, but the binary has {shown}"[:300]
        for v in fmu.inputs:
            wanted = fmu.excitation(v, 3)
            made.set(v, wanted)
            if (got := made.get(v)) != wanted:
                yield f"{v.name}: set to {wanted[0]!r}, but {got[0]!r} is read back"


def _stored(v: Any, values: Values) -> Values:
    """Return the values after conversion to the type of the variable v."""
    return tuple([struct.unpack("f", struct.pack("f", x))[0] for x in values]) if v.type == "Float32" else values


def steps(fmu: ForeignFmu) -> Iterator[str]:
    """Check that all outputs of a run are finite, and that the run ends with `terminate`.

    If the FMU ends the simulation earlier, refuses a step or crashes, all other trials make only the steps before this
    step.
    """
    names = [v.name for v in fmu.outputs for _ in range(count(v))]
    finite = True
    with fmu.running() as made:
        for k in range(STEPS):
            fmu.reach(k)
            try:
                row = fmu.step(made, k)
            except Finding as e:
                if k == 0:
                    raise
                yield f"{e} (while {STEPPED})"
                return
            if row is None:
                if k == 0:
                    raise Finding("the FMU ends the simulation in its first step")
                return
            for name, x in zip(names, row, strict=True):
                if finite and not math.isfinite(x):
                    finite = False
                    yield f"{name} is {x} after step {k + 1}"
        fmu.reach(STEPS)
        try:
            made.call("terminating", "terminate")
        except Finding as e:
            yield f"{e} (while {STEPPED})"


def two_instances(fmu: ForeignFmu) -> Iterator[str]:
    """Check that two instances in one process are independent and give equal runs."""
    if fmu.description.coSimulation.canBeInstantiatedOnlyOncePerProcess:
        return
    with fmu.running() as made, fmu.running() as other:
        want, got = fmu.run(made, range(fmu.steps // 2)), fmu.run(other, range(fmu.steps // 2))
        if where := fmu.difference(want, got):
            yield f"the same run in a second instance differs: {where}"
            return
    with fmu.running() as made, fmu.running() as other:
        got = []
        for k in range(fmu.steps // 2):
            if (values := fmu.step(made, k)) is None:
                break
            got.append(values)
            fmu.step(other, k, row=k + 7)
        if where := fmu.difference(want, got):
            yield f"a second instance changes the run of the first: {where}"


def _without_effect(fmu: ForeignFmu, act: Callable[[Instance, Values], None], what: str) -> Iterator[str]:
    """Check that a run does not change if the function `act` is called after each step; `what` describes its action."""
    with fmu.running() as made:
        want = fmu.run(made, range(fmu.steps))
    with fmu.running() as made:
        if where := fmu.difference(want, fmu.run(made, range(fmu.steps), act)):
            yield f"{what} changes the run: {where}"


def reading(fmu: ForeignFmu) -> Iterator[str]:
    """Check that reading an output has no side effect."""

    def read_again(made: Instance, values: Values) -> None:
        for _ in range(2):
            if where := fmu.difference([values], [fmu.read(made)]):
                raise Finding(f"reading the outputs changes them: {where.rsplit(' after', 1)[0]}")

    return _without_effect(fmu, read_again, "reading the outputs between the steps")


def setting(fmu: ForeignFmu) -> Iterator[str]:
    """Check that setting an input to another value and back has no effect."""

    def set_others(made: Instance, values: Values) -> None:
        for v in fmu.inputs:
            kept = made.get(v)
            made.set(v, fmu.excitation(v, 5))
            made.set(v, kept)

    return _without_effect(fmu, set_others, "setting an input to another value and back")


def _after(fmu: ForeignFmu, v: Any, value: Values, h: float) -> Values:
    """Return the outputs after several steps and a last step of length h (s), in which the input v is `value`."""
    n = fmu.steps // 5
    with fmu.running() as made:
        fmu.run(made, range(n))
        for other in fmu.inputs:
            made.set(other, value if other is v else fmu.excitation(other, n))
        made.step(f"step {n + 1}", fmu.t0 + n * fmu.h, h)
        return fmu.read(made)


def _any_step(fmu: ForeignFmu) -> bool:
    """Return whether the model description permits communication steps of any length."""
    can = fmu.description.coSimulation
    fixed = getattr(can, "fixedInternalStepSize", None)
    return fixed is None and bool(getattr(can, "canHandleVariableCommunicationStepSize", fmu.version == 1))


def step_lengths(fmu: ForeignFmu) -> Iterator[str]:
    """Check that the FMU accepts steps of different lengths if its description permits them."""
    if fmu.version == 1 or not _any_step(fmu):
        return
    with fmu.running() as made:
        t = fmu.t0
        for part in (1.0, 0.5, 0.25, 0.75, 1.5)[: max(fmu.steps // 2, 1)]:
            if not made.step(f"a step of {part:g} times the step size", t, part * fmu.h):
                yield f"the FMU ends the simulation at {t:g} s when its step varies, but not in equal steps"
                return
            t += part * fmu.h


def dependencies(fmu: ForeignFmu) -> Iterator[str]:
    """Check that direct feed-through is declared in `dependencies`.

    Direct feed-through changes an output within a step of any length. An FMU that differentiates a filtered signal also
    changes its output within a short step, although it has no direct feed-through. Only Model Exchange can keep the
    states constant, so an FMU that supports Model Exchange is checked in Model Exchange.
    """
    can = fmu.description
    if can.modelExchange or not _any_step(fmu):
        return
    declared = {u.variable.name: u.dependencies for u in fmu.description.outputs}
    names = [v.name for v in fmu.outputs for _ in range(count(v))]
    for v in fmu.inputs[:_MOST_PAIRS]:
        silent = {n for n, d in declared.items() if d is not None and v.name not in [x.name for x in d]}
        if not silent:
            continue
        n = fmu.steps // 5
        values = fmu.excitation(v, n), fmu.excitation(v, n + 2)
        moves = []
        for h in (fmu.h, _SMALL * fmu.h):
            a, b = (_after(fmu, v, value, h) for value in values)
            moves.append([abs(x - y) for x, y in zip(a, b, strict=True)])
        for name, far, near in zip(names, *moves, strict=True):
            if name in silent and near > 0.1 * far and near > 1e-9:
                yield f"{name} depends on {v.name} at once, but modelDescription.xml says that it does not"


def derivatives(fmu: ForeignFmu) -> Iterator[str]:
    """Check that directional derivatives agree with finite differences."""
    if "CoSimulation" not in fmu.with_derivatives:
        return
    scalar = [v for v in fmu.inputs if v.type in REAL and not v.shape]
    pairs = [(y, u) for y in fmu.outputs if y.type in ("Real", "Float64") and not y.shape for u in scalar]
    with fmu.instance() as made:

        def value(y: Any, u: Any, off: float) -> float:
            made.set(u, fmu.excitation(u, 3, off))
            return made.get(y)[0]

        for y, u in pairs[:_MOST_PAIRS]:
            value(y, u, 0.0)
            got = made.derivative(y, u)
            e = 1e-6 * max(1.0, abs(fmu.excitation(u, 3)[0]))
            if other := tangent_differs(got, partial(value, y, u), e):
                yield (
                    f"the directional derivative of {y.name} with respect to {u.name} is {got:.6g}, "
                    f"but differences give {other}"
                )
            value(y, u, 0.0)


_MADE = MADE["CoSimulation"]
TRIALS = (
    making("CoSimulation"),
    Trial("reading the start values", start_values, _MADE),
    Trial(STEPPED, steps, _MADE),
    Trial("running a second instance", two_instances, STEPPED),
    Trial("reading outputs between the steps", reading, STEPPED),
    Trial("setting inputs between the steps", setting, STEPPED),
    Trial("resetting", reset, STEPPED),
    Trial("saving and restoring the state", saved_states, STEPPED),
    Trial("freeing NULL", null_pointers, _MADE),
    Trial("making steps of different lengths", step_lengths, STEPPED),
    Trial("checking the dependencies", dependencies, STEPPED),
    Trial("comparing directional derivatives with differences", derivatives, _MADE),
    Trial("making many steps", leaks, STEPPED),
    Trial("loading and unloading", loading, STEPPED),
)
