"""Foreign FMUs that the master cannot call directly: other types of variables, Model Exchange only, FMI 1.0.

The master in C calls these FMUs through the same three functions as any other FMU.
"""

from __future__ import annotations

import ctypes as C
from collections.abc import Callable, Sequence
from typing import Any

from hystfmu.fmu.foreign.instance import Finding
from hystfmu.fmu.foreign.simulated import Simulated
from hystfmu.scenario.engine.fmu_member import FmuMember, FmuStore
from hystfmu.scenario.engine.member import Calls, Slot, SteppedMember
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.system import Part, System

_ERROR = 3
_SET = C.CFUNCTYPE(C.c_int, C.c_void_p, C.c_void_p, C.c_size_t, C.POINTER(C.c_double))
_STEP = C.CFUNCTYPE(C.c_int, C.c_void_p, C.c_double, C.c_double, C.c_int)
_SAVE = C.CFUNCTYPE(C.c_int, C.c_void_p, C.POINTER(C.c_void_p))
_RESTORE = C.CFUNCTYPE(C.c_int, C.c_void_p, C.c_void_p)


def fmu_member(
    system: System,
    part: Part,
    sources: Sequence[tuple[int, int]],
    values: C.Array[C.c_double],
    store: FmuStore | None,
    clock: C.c_double,
) -> SteppedMember:
    """Return the member for an FMU. The master calls the FMU directly if possible."""
    if isinstance(part.graph, Foreign) and not part.graph.direct:
        return AdaptedMember(system, part, part.graph, sources, values, clock)
    return FmuMember(system, part, sources, values, store, clock)


class AdaptedMember(SteppedMember):
    """A foreign FMU whose variables are set and read one by one, by their types."""

    def __init__(
        self,
        system: System,
        part: Part,
        foreign: Foreign,
        sources: Sequence[tuple[int, int]],
        values: C.Array[C.c_double],
        clock: C.c_double,
    ) -> None:
        super().__init__(system, part, sources, values, clock, foreign.fmi)
        if self._rollback and not foreign.saves:
            raise Stopped(f"{part.name}: iterative coupling needs an FMU that can get and set its state")
        self._variables = {p.name: p.variable for p in foreign.ports}
        self._constants = [(self._variables[name], [part.constants[n] for n in names]) for name, names in self.fixed]
        self._states: dict[int, Any] = {}
        self._last: int | None = None
        try:
            self._unit = Simulated(
                foreign.folder,
                foreign.description,
                self._of(self.linked),
                self._of(self.read_back),
                part.name,
                self._said.append,
            )
            self._unit.set_parameters(foreign.settings)
        except Finding as e:
            raise Stopped(f"{part.name}: {e}") from None
        self._call(part, self._put_all, self._advance_once, self._get_all)

    def _of(self, wanted: Sequence[Slot]) -> list[tuple[Any, int]]:
        return [(self._variables[name], len(names)) for name, names in wanted]

    def _status(self, call: Callable[[], object]) -> int:
        """Make a call. A finding becomes the last message of the FMU."""
        try:
            call()
        except Exception as e:  # nothing may escape into the master in C
            self._said.append(str(e) if isinstance(e, Finding) else f"{type(e).__name__}: {e}")
            return _ERROR
        return 0

    def _put_all(self) -> int:
        return self._status(lambda: self._unit.put(list(self._u)))

    def _advance_once(self) -> int:
        return self._status(lambda: self._unit.step(self._t.value, self._h.value))

    def _get_all(self) -> int:
        def get() -> None:
            for k, x in enumerate(self._unit.get()):
                self._y[k] = x

        return self._status(get)

    def start(self, t0: float) -> None:
        self._copy()
        if self._status(lambda: self._unit.start(t0, list(self._u), self._constants)):
            raise Stopped(f"{self.name} cannot be initialized: {self.said}")
        self.take()

    def save(self) -> None:
        if self._lines is not None:
            self._lines.save()
        if self._last is not None:
            self.free_state(self._last)
        self._last = self._keep()

    def _keep(self) -> int:
        number = max(self._states, default=0) + 1
        self._states[number] = self._unit.save()
        return number

    def restore(self) -> None:
        if self._lines is not None:
            self._lines.restore()
        assert self._last is not None
        self._unit.restore(self._states[self._last])

    def free_state(self, state: int) -> None:
        self._unit.forget(self._states.pop(state))

    def calls(self) -> Calls:
        n = len(self._y)

        def put(_c: Any, _r: Any, size: int, u: Any) -> int:
            return self._status(lambda: self._unit.put(u[:size]))

        def step(_c: Any, t: float, h: float, _forward: int) -> int:
            return self._status(lambda: self._unit.step(t, h))

        def get(_c: Any, _r: Any, _size: int, y: Any) -> int:
            def read() -> None:
                for k, x in enumerate(self._unit.get()):
                    y[k] = x

            return self._status(read)

        def save(_c: Any, state: Any) -> int:
            def keep() -> None:
                if state[0]:
                    self.free_state(state[0])
                state[0] = self._keep()

            return self._status(keep)

        def restore(_c: Any, state: int) -> int:
            return self._status(lambda: self._unit.restore(self._states[state]))

        kinds: list[tuple[Any, Any]] = [(_SET, put), (_STEP, step), (_SET, get), (_SAVE, save), (_RESTORE, restore)]
        self._callbacks = [kind(function) for kind, function in kinds]  # they live as long as the member
        functions = [C.cast(f, C.c_void_p).value for f in self._callbacks]
        vr_in, vr_out = ((C.c_uint32 * size)() for size in (len(self._u), n))
        return Calls(
            False,
            functions if self._rollback else functions[:3],
            None,
            1,
            self.sources,
            list(self._u),
            vr_in,
            vr_out,
            self._rollback,
        )

    def close(self) -> None:
        for state in list(self._states):
            self.free_state(state)
        self._unit.close()
