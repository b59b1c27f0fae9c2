"""Saved states are bit-exact, also in other instances; freed, foreign, truncated and damaged states are refused."""

from __future__ import annotations

import ctypes as C
from collections.abc import Callable

import numpy as np
import pytest
from fmu_master import BLOCKS, ERROR, OK, H, Master, loop, rows, single

Make = Callable[..., Master]
GONE = "The FMU state was freed or does not belong to this instance."
U = rows(single("prandtl_ishlinskii"))[:, 0]


@pytest.mark.parametrize("name", [*BLOCKS, "loop"])
def test_restore_is_bit_exact(make: Make, name: str) -> None:
    graph = loop() if name == "loop" else single(name)
    m, other = make(graph), make(graph)
    inputs = [p for p in graph.ports if p.kind == "input"]
    outputs = [p.name for p in graph.ports if p.kind == "output"]
    u = rows(graph, 120)

    def steps(m: Master, first: int, last: int) -> list[object]:
        y = []
        for k in range(first, last):
            at = 0
            for p in inputs:
                assert m.set(p.name, *u[k, at : at + p.size]) == OK
                at += p.size
            assert m.step(k * H) == OK
            y.append([m.get(o) for o in outputs])
        return y

    m.initialize()
    steps(m, 0, 60)
    state = m.save()
    content = m.serialize(state)
    want = steps(m, 60, 120)
    assert m.restore(state) == OK
    assert steps(m, 60, 120) == want
    status, again = other.deserialize(content)
    assert status == OK
    assert other.restore(again) == OK
    assert steps(other, 60, 120) == want, "in another instance"


def test_parameters_and_phase_are_part_of_a_state(make: Make) -> None:
    m = make(single("backlash_sum"))
    new = m.save()
    m.set("w0", 2.0)
    m.initialize()
    m.run(U[:10])
    running = m.save()
    assert m.restore(new) == OK
    assert m.step(0.0) == ERROR, "the state is Instantiated again"
    m.initialize()
    assert m.get("w0") == 0.0
    assert m.restore(running) == OK
    assert m.get("w0") == 2.0
    assert m.step(10 * H) == OK


def test_overwriting_a_state(make: Make) -> None:
    m = make()
    m.initialize()
    state = m.save()
    m.run(U[:5])
    address = state.value
    name = "GetFMUstate" if m.fmi == 2 else "GetFMUState"
    assert m.call(name, C.byref(state)) == OK
    assert state.value == address
    now = m.memory()
    m.run(U[5:9], first=5)
    assert m.restore(state) == OK
    assert m.memory() == now


@pytest.mark.parametrize("address", [0, 1, 0xDEADBEEF, 2**63])
def test_foreign_pointers(make: Make, address: int) -> None:
    m, other = make(), make()
    foreign = other.save()
    for state in (foreign, C.c_void_p(address)):
        assert m.restore(state) == ERROR
        assert m.messages[-1][2] == GONE
    assert m.forget(foreign) == ERROR
    assert other.forget(foreign) == OK


def test_damaged_bytes(make: Make) -> None:
    m = make()
    m.initialize()
    m.run(U[:7])
    content = m.memory()
    rng = np.random.default_rng(5)
    for n in [0, 1, 63, 64, len(content) - 1, *rng.integers(0, len(content), 30)]:
        assert m.deserialize(content[:n])[0] == ERROR
    for at in [*range(64), *rng.integers(64, len(content), 60)]:
        damaged = bytearray(content)
        damaged[at] ^= 1 << int(rng.integers(8))
        status, state = m.deserialize(bytes(damaged))
        assert status == ERROR, f"byte {at}"
        assert state.value is None
        assert m.messages[-1][2].startswith("The serialized state cannot be read: ")
    assert m.memory() == content
    assert m.deserialize(content + b"more")[0] == OK


def test_many_states_survive_a_reset(make: Make) -> None:
    m = make()
    m.initialize()
    states = []
    for k in range(200):
        m.run(U[k : k + 1], first=k)
        states.append((m.save(), m.memory()))
    assert m.call("Reset") == OK
    for state, content in reversed(states):
        assert m.restore(state) == OK
        assert m.memory() == content
