"""Serialized states from outside: every field of a forged state is checked before it becomes one."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Callable

import numpy as np
import pytest
from fmu_master import ERROR, OK, H, Master, rows, single

from hystfmu.graph import Graph, Node

Make = Callable[..., Master]
U = rows(single("prandtl_ishlinskii"))[:, 0]
BAD = "The serialized state cannot be read: "
HEADER, RUN = 64, 32 + 7 * 8  # magic, version, checksum, length, token; eight integers and seven numbers
WORDS = ["interface", "event_mode", "phase", "stop_defined", "stale", "changed", "moving", "jump"]
NUMBERS = ["t", "stop", "dt", "clock", "start", "samples", "redo"]


def forged(content: bytes, at: int, new: bytes) -> bytes:
    """Other bytes at a place, with the checksum of a state that was saved so."""
    changed = content[:at] + new + content[at + len(new) :]
    return changed[:12] + struct.pack("<I", zlib.crc32(changed[16:])) + changed[16:]


def word(content: bytes, name: str, value: int) -> bytes:
    return forged(content, HEADER + 4 * WORDS.index(name), struct.pack("<i", value))


def number(content: bytes, name: str, value: float) -> bytes:
    return forged(content, HEADER + 32 + 8 * NUMBERS.index(name), struct.pack("<d", value))


def said(m: Master, content: bytes) -> str:
    """What the unit answers; nothing if it takes the state."""
    m.messages.clear()
    status, state = m.deserialize(content)
    assert (status == OK) == bool(state.value)
    assert status in (OK, ERROR)
    if status == OK:
        assert m.forget(state) == OK
        return ""
    assert len(m.messages) == 1
    assert m.messages[0][2].startswith(BAD)
    return m.messages[0][2].removeprefix(BAD).removesuffix(".")


@pytest.fixture
def run(make: Make) -> tuple[Master, bytes]:
    m = make(single("backlash_sum"))
    m.initialize(stop=1.0)
    m.run(U[:5])
    return m, m.memory()


@pytest.mark.parametrize("name", NUMBERS)
def test_numbers_of_the_run_are_finite(run: tuple[Master, bytes], name: str) -> None:
    m, content = run
    for bad in (math.nan, math.inf, -math.inf):
        assert said(m, number(content, name, bad)) == "a value is out of range"
    assert m.memory() == content


def test_steps_of_the_run_are_in_range(run: tuple[Master, bytes]) -> None:
    m, content = run
    for name, value, good in [
        ("dt", 0.0, True),
        ("dt", 1e9, True),
        ("dt", math.nextafter(1e9, math.inf), False),
        ("dt", -5e-324, False),
        ("redo", 0.0, True),
        ("redo", 1e9, True),
        ("redo", math.nextafter(1e9, math.inf), False),
        ("redo", -5e-324, False),
        ("t", -1e300, True),
        ("samples", -1.0, True),
    ]:
        assert said(m, number(content, name, value)) == ("" if good else "a value is out of range"), (name, value)


def test_a_state_of_another_kind_of_instance(run: tuple[Master, bytes]) -> None:
    m, content = run
    for name, value in [("interface", 2), ("interface", 0), ("event_mode", 1)]:
        assert said(m, word(content, name, value)) == "it belongs to another interface of the standard"
    for name in ("stop_defined", "stale", "changed", "jump"):
        assert said(m, word(content, name, 1)) == ""


def test_the_header(run: tuple[Master, bytes]) -> None:
    m, content = run
    n = len(content)
    assert struct.unpack("<8sIIQ", content[:24])[::3] == (b"HYSTSTAT", n)
    assert content[24:64].rstrip(b"\0").decode() == m.graph.token
    for bad, why in [
        (content[: HEADER - 1], "it is too short"),
        (content[:HEADER], "it is truncated"),
        (content[: n - 1], "it is truncated"),
        (b"h" + content[1:], "it is not a state of such a unit"),
        (forged(content, 8, struct.pack("<I", 4)), "its version is unknown"),
        (forged(content, 24, b"{"), "it was saved by another model"),
        (forged(content, 16, struct.pack("<Q", n - 8)), "it belongs to another interface of the standard"),
        (content[:12] + bytes(4) + content[16:], "its checksum does not match"),
        (content[:-1] + bytes([content[-1] ^ 1]), "its checksum does not match"),
    ]:
        assert said(m, bad) == why
    assert said(m, content + b"more") == said(m, content) == ""
    assert m.memory() == content


def test_values_that_a_call_would_refuse(make: Make, fmi: int) -> None:
    """Parameters, inputs and derivatives of inputs are checked, outputs are not: they follow."""
    graph = Graph.single(Node("b", "backlash_sum", {}, {"w0": 0.625, "r": [0.375], "w": [0.875]})).with_step(H)
    m = make(graph)
    m.initialize()
    assert m.set("u", 0.6875) == OK
    assert m.step(0.0) == OK
    content = m.memory()
    values = np.frombuffer(content[HEADER + RUN :]).tolist()
    slopes = fmi == 2  # FMI 3.0 asks for inputs by a callback instead
    for name, value, bad in [
        ("w0", 0.625, [math.nan, math.inf]),
        ("r", 0.375, [-0.125, math.nan]),
        ("w", 0.875, [math.inf]),
        ("u", 0.6875, [math.nan, -math.inf]),
    ]:
        assert values.count(value) >= 1, name
        places = [HEADER + RUN + 8 * k for k, v in enumerate(values) if v == value]
        for x in bad:
            answers = {said(m, forged(content, at, struct.pack("<d", x))) for at in places}
            assert "a value is out of range" in answers, (name, x)
    for x in (math.nan, math.inf):
        assert said(m, forged(content, HEADER + RUN, struct.pack("<d", x))) == "a value is out of range"
    y = HEADER + RUN + 8 * values.index(m.get("y"))
    assert said(m, forged(content, y, struct.pack("<d", math.nan))) == ""
    assert said(m, word(content, "moving", 1)) == ("" if slopes else "a value is out of range")
    assert m.memory() == content


def test_a_state_that_is_read_is_computed_anew(make: Make) -> None:
    """Outputs and derived values of the bytes are not trusted: a changed parameter acts from the next evaluation."""
    graph = Graph.single(Node("b", "backlash_sum", {}, {"w0": 0.625, "r": [0.375], "w": [0.0]})).with_step(H)
    m = make(graph)
    m.initialize()
    content = m.memory()
    values = np.frombuffer(content[HEADER + RUN :]).tolist()
    status, state = m.deserialize(forged(content, HEADER + RUN + 8 * values.index(0.625), struct.pack("<d", 2.0)))
    assert status == OK
    assert m.restore(state) == OK
    assert m.get("w0") == 2.0
    assert m.set("u", 0.5) == OK
    assert m.step(0.0) == OK
    assert m.get("y") == 1.0
