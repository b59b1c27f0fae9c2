"""What a well-behaved FMU does, tried out on somebody's FMU: every trial yields its findings as sentences.

The traps come from FMUs in the field: states that advance when an output is read, memory lost with every step, globals
shared by instances, a reset that forgets something.  Every comparison of runs is bit for bit.
"""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from hystfmu.fmu.check.foreign_library import Finding, Guest, Instance, Values, slope_differs

STEPS = 100
_SMALL = 1e-4  # of a step: what depends on an input at once still moves as far, what goes through a state does not
_LEAK, _LEAST_GROWTH = 32, 1 << 20  # bytes per step; bytes in all that are no noise of the allocator
_MOST_PAIRS = 64

Trial = Callable[[Guest], Iterator[str]]


def start_values(guest: Guest) -> Iterator[str]:
    """The binary has the start values of the description, and returns what was set."""
    with guest.instance() as made:
        for v in guest.variables:
            if v.causality in ("input", "parameter") and v.start is not None:
                read, start = made.get(v), guest.start(v)
                if read != start:
                    shown = read[0] if len(read) == 1 else list(read)
                    yield f"{v.name}: the start value is {v.start}, but the binary has {shown}"[:300]
        for v in guest.inputs:
            wanted = guest.excitation(v, 3)
            made.set(v, wanted)
            if (got := made.get(v)) != wanted:
                yield f"{v.name}: set to {wanted[0]!r}, but {got[0]!r} is read back"


def steps(guest: Guest) -> Iterator[str]:
    """Finite outputs."""
    with guest.running() as made:
        run = guest.run(made, range(STEPS))
        names = [v.name for v in guest.outputs for _ in made.get(v)]
    for k, row in enumerate(run):
        for name, x in zip(names, row, strict=True):
            if not math.isfinite(x):
                yield f"{name} is {x} after step {k + 1}"
                return


def two_instances(guest: Guest) -> Iterator[str]:
    """Two instances in one process do not know of each other, and run alike."""
    if guest.description.coSimulation.canBeInstantiatedOnlyOncePerProcess:
        return
    with guest.running() as made, guest.running() as other:
        want, got = guest.run(made, range(STEPS // 2)), guest.run(other, range(STEPS // 2))
        if where := guest.difference(want, got):
            yield f"the same run in a second instance differs: {where}"
            return
    with guest.running() as made, guest.running() as other:
        got = []
        for k in range(STEPS // 2):
            got.append(guest.step(made, k))
            guest.step(other, k, row=k + 7)
        if where := guest.difference(want, got):
            yield f"a second instance changes the run of the first: {where}"


def reading(guest: Guest) -> Iterator[str]:
    """Reading an output changes nothing."""
    with guest.running() as made:
        want = guest.run(made, range(STEPS))

    def read_again(made: Instance, values: Values) -> None:
        for _ in range(2):
            if where := guest.difference([values], [guest.read(made)]):
                raise Finding(f"reading the outputs changes them: {where.rsplit(' after', 1)[0]}")

    with guest.running() as made:
        if where := guest.difference(want, guest.run(made, range(STEPS), read_again)):
            yield f"reading the outputs between the steps changes the run: {where}"


def setting(guest: Guest) -> Iterator[str]:
    """Setting an input to another value and back changes nothing."""
    with guest.running() as made:
        want = guest.run(made, range(STEPS))

    def set_others(made: Instance, values: Values) -> None:
        for v in guest.inputs:
            kept = made.get(v)
            made.set(v, guest.excitation(v, 5))
            made.set(v, kept)

    with guest.running() as made:
        if where := guest.difference(want, guest.run(made, range(STEPS), set_others)):
            yield f"setting an input to another value and back changes the run: {where}"


def reset(guest: Guest) -> Iterator[str]:
    """After reset the instance is like a new one."""
    with guest.running() as made:
        want = guest.run(made, range(STEPS // 2))
        made.call("reset", "reset")
        made.initialize(guest.t0)
        made.call("leaving Initialization Mode after reset", "exitInitializationMode")
        if where := guest.difference(want, guest.run(made, range(STEPS // 2))):
            yield f"after reset the run differs from that of a new instance: {where}"


def saved_states(guest: Guest) -> Iterator[str]:
    """A restored state continues bit for bit, as often as it is restored; also through its bytes."""
    can = guest.description.coSimulation
    if not can.canGetAndSetFMUstate:
        return
    half, rest = range(STEPS // 2), range(STEPS // 2, STEPS)
    fmi2 = guest.description.fmiVersion.startswith("2")
    spelling = "FMUstate" if fmi2 else "FMUState"
    with guest.running() as made:
        guest.run(made, half)
        state = made.call("saving the state", f"get{spelling}")
        want = guest.run(made, rest)
        for times in ("", " a second time"):
            made.call("restoring the state", f"set{spelling}", state)
            if where := guest.difference(want, guest.run(made, rest), half.stop):
                yield f"after restoring a saved state{times} the run differs: {where}"
                return
        if can.canSerializeFMUstate:
            content = made.call("serializing the state", f"serialize{spelling}", state)
            load = "deSerializeFMUstate" if fmi2 else "deserializeFMUState"
            loaded = made.call("deserializing the state", load, content)
            made.call("restoring the deserialized state", f"set{spelling}", loaded)
            if where := guest.difference(want, guest.run(made, rest), half.stop):
                yield f"after restoring a state from its bytes the run differs: {where}"
            made.call("freeing a state", f"free{spelling}", loaded)
        made.call("freeing a state", f"free{spelling}", state)


def _after(guest: Guest, v: Any, value: Values, h: float) -> Values:
    """Outputs after some steps and one of length h, in which the input v is set to `value`."""
    n = STEPS // 5
    with guest.running() as made:
        guest.run(made, range(n))
        for other in guest.inputs:
            made.set(other, value if other is v else guest.excitation(other, n))
        made.call(f"step {n + 1}", "doStep", guest.t0 + n * guest.h, h)
        return guest.read(made)


def dependencies(guest: Guest) -> Iterator[str]:
    """An output that moves at once with an input says so in its dependencies.

    At once means in a step however short.  A unit that takes differences of a filtered signal does so too, without a
    dependency: its states can be held in Model Exchange alone, so one that has it is tried there.
    """
    can = guest.description
    if can.modelExchange or not can.coSimulation.canHandleVariableCommunicationStepSize:
        return
    declared = {u.variable.name: u.dependencies for u in guest.description.outputs}
    names = [v.name for v in guest.outputs for _ in range(math.prod(v.shape) if v.shape else 1)]
    for v in guest.inputs[:_MOST_PAIRS]:
        silent = {n for n, d in declared.items() if d is not None and v.name not in [x.name for x in d]}
        if not silent:
            continue
        n = STEPS // 5
        values = guest.excitation(v, n), guest.excitation(v, n + 2)
        moves = []
        for h in (guest.h, _SMALL * guest.h):
            a, b = (_after(guest, v, value, h) for value in values)
            moves.append([abs(x - y) for x, y in zip(a, b, strict=True)])
        for name, far, near in zip(names, *moves, strict=True):
            if name in silent and near > 0.1 * far and near > 1e-9:
                yield f"{name} depends on {v.name} at once, but modelDescription.xml says that it does not"


def derivatives(guest: Guest) -> Iterator[str]:
    """Directional derivatives agree with differences."""
    if "CoSimulation" not in guest.with_derivatives:
        return
    scalar = [v for v in guest.inputs if not v.shape]
    pairs = [(y, u) for y in guest.outputs if y.type in ("Real", "Float64") and not y.shape for u in scalar]
    with guest.instance() as made:

        def value(y: Any, u: Any, off: float) -> float:
            made.set(u, guest.excitation(u, 3, off))
            return made.get(y)[0]

        for y, u in pairs[:_MOST_PAIRS]:
            value(y, u, 0.0)
            got = made.derivative(y, u)
            e = 1e-6 * max(1.0, abs(guest.excitation(u, 3)[0]))
            if slope := slope_differs(got, partial(value, y, u), e):
                yield f"the derivative of {y.name} with respect to {u.name} is {got:.6g}, differences give {slope}"
            value(y, u, 0.0)


def _resident() -> int:
    """Bytes of memory in use by this process, 0 where that cannot be read."""
    statm = Path("/proc/self/statm")
    return int(statm.read_text().split()[1]) * 4096 if statm.exists() else 0


def leaks(guest: Guest, most: int = 20_000, seconds: float = 10.0) -> Iterator[str]:
    """Many steps: the memory in use does not grow with their number."""
    end, done, warm, before = time.monotonic() + seconds, 0, most // 10, 0
    with guest.running() as made:
        while done < most and time.monotonic() < end:
            guest.step(made, done)
            done += 1
            if done == warm:
                gc.collect()
                before = _resident()
        gc.collect()
        growth = _resident() - before
        if done > warm and growth > max(_LEAST_GROWTH, _LEAK * (done - warm)):
            yield f"memory grows by {growth / (done - warm):.0f} bytes per step (over {done - warm} steps)"


def loading(guest: Guest) -> Iterator[str]:
    """Loaded and unloaded again and again: the same run, and no growth."""
    runs, before = [], 0
    for cycle in range(20):
        with guest.running() as made:
            runs.append(guest.run(made, range(5)))
        if cycle == 4:
            before = _resident()
    for cycle, run in enumerate(runs):
        if where := guest.difference(runs[0], run):
            yield f"after loading the binary {cycle + 1} times the run differs: {where}"
            return
    growth = _resident() - before
    if growth > 4 * _LEAST_GROWTH:
        yield f"memory grows by {growth // 15} bytes with every load and unload"


TRIALS: dict[str, Trial] = {
    "reading the start values": start_values,
    "making 100 steps": steps,
    "running a second instance": two_instances,
    "reading outputs between the steps": reading,
    "setting inputs between the steps": setting,
    "resetting": reset,
    "saving and restoring the state": saved_states,
    "trying the dependencies": dependencies,
    "comparing derivatives with differences": derivatives,
    "making many steps": leaks,
    "loading and unloading": loading,
}
