"""Simulate a case. A case with foreign FMUs runs in a child process with limits of time and memory.

The child process may crash or hang without harm to this process. It returns the results in two files of a known format.
These files are untrusted, so they are never unpickled.

There are two engines. The engine "fmpy" is the reference: a master loop in Python calls FMUs through fmpy. The engine
"native" runs the whole loop in the C core. Both engines use the same time grid, coupling and values, so their results
are bit-identical. The matrix of Newton's method and its updates are the same as in `fmu_build/master/newton.c`.
Tangents are propagated from unit to unit as in `master.c`.
"""

from __future__ import annotations

import ctypes as C
import json
import math
import pickle
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import IO, Any, Literal, get_args

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.child import Child, late, limit_memory, open_result, read_result
from hystfmu.base.confine import CANNOT, Box
from hystfmu.base.errors import InputError
from hystfmu.core.library import library
from hystfmu.fmu.foreign.instance import Finding
from hystfmu.scenario.engine.fmu_member import FmuMember, FmuStore, fmu_member
from hystfmu.scenario.engine.member import Member
from hystfmu.scenario.outcome.trace import Stopped, Sweeps, Trace
from hystfmu.scenario.system.events import cuts
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.spec import Scheme
from hystfmu.scenario.system.system import System


class Newton:
    """Newton's method for one time step with iterative coupling.

    The unknowns (the guess) are the values that a unit uses before their source has made the step. `due` contains the
    units that make this step.

    `values` contains all values of the system.
    """

    def __init__(self, system: System, due: Sequence[Member], values: Array) -> None:
        self._values, self._early = values, system.early()
        n = len(self._early)
        loops = {system.parts[k].name for k in system.loops()}
        width = {p.name: (p.first, len(p.outputs)) for p in system.parts}
        # Newton is used only if all units in loops have tangents, so an adapted FMU is never called here
        inside = [m if isinstance(m, FmuMember) and m.name in loops else None for m in due]
        own = [slice(width[m.name][0], sum(width[m.name])) for m in due]
        self._due = list(zip(due, inside, own, strict=True))
        names = {m.name for m in due}
        self._steps = [system.parts[k].name in names for k in system.makers().tolist()]
        self._J, self._H, self._change, self._room = np.empty((n, n)), np.empty((n, n)), np.empty(n), np.empty(2 * n)
        self._lib, self._n = library(), C.c_int64(n)

    def start(self, begin: Array, guess: Array) -> bool:
        """Compute and factor the Jacobian matrix after the first sweep. Return whether the matrix can be used.

        `begin` contains the values at the start of the step, and `guess` contains the unknowns of the first sweep.

        The result is False if a tangent is not finite or the matrix is singular (loop gain of one).
        """
        for c, steps in enumerate(self._steps):
            d, read = np.zeros_like(self._values), begin.copy()
            read[self._early] = guess
            d[self._early[c]] = float(steps)  # the outputs of a unit that makes no step are constant
            for m, inside, own in self._due:
                if not self._follow(m, inside, own, begin, read, d):
                    return False
                read[own] = self._values[own]
            self._J[:, c] = d[self._early]
        return not self._lib.newton_start(self._n, _at(self._J), _at(self._H))

    @staticmethod
    def _follow(m: Member, inside: FmuMember | None, own: slice, begin: Array, read: Array, d: Array) -> bool:
        """Write the tangent of the outputs of a unit into `d`, for the direction in which the inputs have changed."""
        du = [float(d[j]) if j >= 0 else 0.0 for j in m.sources]
        along = 0.0
        for j, v in zip(m.sources, du, strict=True):
            along += v * float(read[j] - begin[j]) if v else 0.0
        d[own] = 0.0
        if inside is None or not any(du) or own.start == own.stop:
            return True
        dy = inside.tangent([-v for v in du] if along < 0 else du)
        if dy is None:
            return False
        d[own] = [-v for v in dy] if along < 0 else dy
        return True

    def step(self, residual: Array) -> Array:
        """Return the Newton step: the change of the guess."""
        self._lib.newton_step(self._n, _at(self._H), _at(residual), _at(self._change))
        return self._change

    def learn(self, before: Array, now: Array) -> None:
        """Update the matrix with the last change of the residual (Broyden)."""
        self._lib.newton_learn(self._n, *[_at(a) for a in (self._H, self._change, before, now, self._room)])


def _at(a: Array) -> C.c_void_p:
    return C.c_void_p(a.ctypes.data)


Engine = Literal["fmpy", "native"]
ENGINES: tuple[Engine, ...] = get_args(Engine)


def chunks_here(system: System, engine: Engine = "fmpy", store: FmuStore | None = None) -> Iterator[Trace]:
    """Simulate a case in this process, including foreign FMUs, and yield chunks of rows.

    Stopped is raised if a unit refuses an input or a step, or if the sweeps of an iterative coupling do not converge.
    """
    if engine not in ENGINES:
        raise InputError(f"engine: must be one of {', '.join(ENGINES)}. Got {engine!r} instead.")
    if engine == "native":
        from hystfmu.scenario.engine.native import Native

        yield from Native(system).chunks()
        return
    if store is None:
        with FmuStore() as own:
            yield from chunks_here(system, engine, own)
        return
    values = (C.c_double * max(system.n_values, 1))(*system.starts())
    sources: dict[int, list[tuple[int, int]]] = {}
    for link in system.links:
        sources.setdefault(link.to, []).append((link.input, link.source))
    members: list[Member] = []
    clocks = {(p.period, p.any_step): C.c_double() for p in system.parts}
    try:
        for k, part in enumerate(system.parts):
            clock = clocks[part.period, part.any_step]
            members.append(fmu_member(system, part, sources.get(k, ()), values, store, clock))
        yield from _loop(system, members, values, clocks)
    finally:
        for m in members:
            m.close()


def _loop(
    system: System,
    members: Sequence[Member],
    values: C.Array[C.c_double],
    clocks: Mapping[tuple[int, bool], C.c_double],
) -> Iterator[Trace]:
    width = system.n_values
    now = np.ctypeslib.as_array(values)[:width]
    # the row is copied as bytes, because a copy by numpy takes three times as long
    n_bytes = 8 * width
    new = memoryview(values).cast("B")[:n_bytes]
    for m in members:
        m.start(0.0)
    for m in members:
        m.begin()
    # which units step at fine step n depends on n modulo the least common multiple of the periods
    cycle = math.lcm(*{m.period for m in members})
    sweeps = Sweeps()
    couple = _coupling(system, now, sweeps)
    known: dict[tuple[int, ...], tuple[list[tuple[C.c_double, int]], Callable[[float], None]]] = {}
    due = []
    for k in range(min(cycle, system.n_steps + 1)):
        periods = tuple(p for p, _ in clocks if k % p == 0)
        if periods not in known:
            running = [(clock, p) for (p, _), clock in clocks.items() if k % p == 0]
            known[periods] = running, couple([m for m in members if k % m.period == 0])
        due.append(known[periods])
    pieces: dict[int, list[float]] = {}
    for n, end in zip(*(a.tolist() for a in cuts(system)), strict=True):
        pieces.setdefault(n, []).append(end)
    cut = [m for m in members if m.any_step]
    piece = couple(cut)
    longest = max(m.period for m in members)
    for first, last in system.chunks():
        times = system.times(max(first - longest, 0), last)
        t, lead = times.tolist(), first - max(first - longest, 0)
        record = np.empty((last - first, width))
        rows = record.reshape(-1).data.cast("B")
        for k in range(last - first):
            n, at = first + k, lead + k
            if n:
                running, step = due[n % cycle]
                for clock, period in running:
                    clock.value = t[at - period]
                if n in pieces:
                    for begin, end in pairwise([t[at - 1], *pieces[n], t[at]]):
                        clocks[1, True].value = begin
                        for m in cut:
                            m.stretch(end - begin)
                        (step if end == t[at] else piece)(end)
                    for m in cut:
                        m.stretch(None)
                else:
                    step(t[at])
            rows[k * n_bytes : (k + 1) * n_bytes] = new
        if not np.isfinite(record).all():
            row = int(np.argwhere(~np.isfinite(record).all(axis=1))[0][0])
            raise Stopped(f"values that are not finite at t = {t[lead + row]:g} s")
        is_last = last > system.n_steps
        # no foreign FMU is in this list, because `plan` refuses this combination
        hashed = members if system.case.final_states and is_last else ()
        hashes = {m.name: m.state_hash() for m in hashed if isinstance(m, FmuMember)}
        yield Trace(times[lead:], record, system.columns, system.case.ripple, hashes, first, replace(sweeps))
        sweeps.all = sweeps.most = sweeps.steps = 0


def _coupling(system: System, values: Array, sweeps: Sweeps) -> Callable[[Sequence[Member]], Callable[[float], None]]:
    """Return a function that advances the system by one fine step, which ends at the given time."""
    spec = system.case.coupling
    early = system.early()

    def gauss_seidel(due: Sequence[Member]) -> Callable[[float], None]:
        # one flat list of calls, because the overhead of nested objects would be as long as a call (a microsecond)
        owner = {id(call): m for m in due for call in m.turn}
        calls = [call for m in due for call in m.turn]

        def run(t: float) -> None:
            for call in calls:
                if call() > 1:
                    raise owner[id(call)].stopped()

        return run

    def jacobi(due: Sequence[Member]) -> Callable[[float], None]:
        def run(t: float) -> None:
            for m in due:
                m.copy()
            for m in due:
                m.advance()
            for m in due:
                m.take()

        return run

    def iterative(due: Sequence[Member]) -> Callable[[float], None]:
        sweep = gauss_seidel(due)
        newton = Newton(system, due, values) if system.newton else None

        def run(t: float) -> None:
            for m in due:
                m.save()
            begin, guess, relax = values.copy(), values[early], 1.0
            last, steep = guess, False
            for k in range(spec.max_sweeps):
                if k > 0:
                    for m in due:
                        m.restore()
                    values[:] = begin
                    values[early] = guess
                sweep(t)
                sweeps.add(Sweeps(1, k + 1, k == 0))
                out = values[early]
                residual = out - guess
                if (np.abs(residual) <= spec.tolerance * (1 + np.abs(out))).all():
                    return
                if k == 0:
                    steep = newton is not None and newton.start(begin, guess)
                elif steep and newton is not None:
                    newton.learn(last, residual)
                else:
                    relax = _relaxation(relax, last, residual)
                change = newton.step(residual) if steep and newton is not None else relax * residual
                guess, last = guess + change, residual
            raise Stopped(f"{spec.max_sweeps} sweeps at t = {t:g} s do not agree; allow more, or a shorter step")

        return run

    return {"gauss_seidel": gauss_seidel, "jacobi": jacobi, "iterative": iterative}[spec.scheme]


def _relaxation(last: float, before: Array, now: Array) -> float:
    """Return the factor of the residual in the next guess: Aitken's relaxation of a vector (Irons & Tuck 1969).

    For one value this is the secant method, which converges for any loop gain except one. The order of the sums is
    fixed, so that the result of the C core is bit-identical.
    """
    along = square = 0.0
    for a, b in zip(before.tolist(), now.tolist(), strict=True):
        change = b - a
        along += a * change
        square += change * change
    return -last * along / square if square > 0 else last


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
        "fmpy" simulates the FMUs of the units with fmpy (reference implementation). "native" runs the whole loop in the
        C core. Their results are bit-identical.
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
