"""Saved states are bit-exact; what a call may not leave behind; forged, freed and damaged states are refused."""

import ctypes as C
import math
import struct
import zlib

import numpy as np
import pytest
from fmu_events import Events
from fmu_master import BLOCKS, ERROR, OK, H, Make, Master, U, loop, mixed, rows, single

from hystfmu import Graph, Node, Unit

GONE = "The FMU state was freed or does not belong to this instance."


@pytest.mark.some(10)
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


# ---- what a call may not leave behind --------------------------------------------------------------------------------
def due(make: Make) -> Events:
    """Model Exchange in Event Mode at the time of a sample, after a step with other inputs."""
    m: Events = make(mixed(), "me")
    m.begin(np.array([0.3]))
    assert m.set_time(H) == OK
    assert m.set("u", 0.8) == OK
    assert m.set_x(np.array([0.01, 2.0])) == OK
    assert m.completed(asks=True) == OK
    assert m.call("EnterEventMode") == OK
    return m


def test_derivatives_leave_no_trace(make: Make) -> None:
    """In every mode; in Event Mode they are differences of trials, from states and inputs that must come back."""
    m = due(make)
    y, u = m.ports["y"].reference, m.ports["u"].reference
    x = sum(p.size for p in m.graph.ports) + 1
    before, outputs = m.memory(), m.outputs()
    for known in (u, x, x + 1):
        assert m.tangent([y], [known], np.array([-2.0]), 1)[0] == OK
        assert m.memory() == before
        assert m.tangent([y], [known], np.array([3.0]), 1)[0] == OK
        assert m.outputs() == outputs
    assert m.memory() == before
    assert m.update() == OK
    m.leave()
    after, seen = m.memory(), m.outputs()
    assert m.tangent([y], [x], np.ones(1), 1)[0] == OK
    assert (m.memory(), m.outputs()) == (after, seen)


@pytest.mark.parametrize(
    ("at", "slopes"), [(-2.0, (1.0, 0.0)), (3.0, (0.0, -1.0)), (-64.0, (0.0, 0.0)), (0.5, (1.0, -1.0))]
)
def test_differences_stay_on_the_side_of_the_seed(make: Make, at: float, slopes: tuple[float, float]) -> None:
    """y = max(-2, min(3, u)) in Initialization Mode, with seeds of either sign and any size."""
    graph = Graph.single(Node("s", "scaling", {"n": 1}, {"lo": -2.0, "hi": 3.0})).with_step(H)
    m = make(graph)
    assert m.enter() == OK
    assert m.set("u", at) == OK
    places = [m.ports["y"].reference], [m.ports["u"].reference]
    for size in (1.0, 1e-3, 1e4):
        for sign, slope in zip((1, -1), slopes, strict=True):
            status, found = m.tangent(*places, np.array([sign * size]), 1)
            assert status == OK
            assert found[0] == pytest.approx(slope * size, abs=1e-6 * size)
    assert m.get("u") == at


@pytest.mark.parametrize("fmi", [2], indirect=True)
def test_a_time_before_the_sample_takes_the_trial_back(make: Make) -> None:
    """FMI 2.0 lets an importer set the time in Event Mode: what was tried at the later time must not stay."""
    tried, other = due(make), due(make)
    tried.outputs()
    for m in (tried, other):
        assert m.set_time(0.5 * H) == OK
    assert tried.outputs() == other.outputs()
    assert tried.memory() == other.memory()


def test_a_restored_state_is_no_trial(make: Make) -> None:
    m: Events = make(mixed(), "me")
    m.begin(np.array([0.3]))
    state, content = m.save(), m.memory()
    assert m.set_time(H) == OK
    assert m.set("u", 0.8) == OK
    assert m.completed(asks=True) == OK
    assert m.call("EnterEventMode") == OK
    m.outputs()
    assert m.restore(state) == OK
    assert m.memory() == content


def test_a_state_that_is_gone_is_refused_by_every_call(make: Make) -> None:
    m: Master = make()
    state = m.save()
    n = len(m.serialize(state))
    assert m.forget(state) == OK
    room = C.create_string_buffer(n)
    for name, arguments in [
        ("SetFMUState", (state,)),
        ("FreeFMUState", (C.byref(C.c_void_p(state.value)),)),
        ("GetFMUState", (C.byref(C.c_void_p(state.value)),)),
        ("SerializedFMUStateSize", (state, C.byref(C.c_size_t()))),
        ("SerializeFMUState", (state, room, C.c_size_t(n))),
    ]:
        m.messages.clear()
        assert m.call(m._state(name), *arguments) == ERROR, name
        assert m.messages == [(ERROR, "logStatusError", GONE)]
    assert m.forget(C.c_void_p(None)) == OK, "the standards: a null pointer is ignored"


def test_a_deserialized_state_needs_no_initial_pointer(make: Make) -> None:
    """The standards: the call constructs a state. The pointer may hold anything before."""
    m: Master = make()
    m.initialize()
    content, room = m.memory(), C.c_void_p(0x10)
    size, name = C.c_size_t(len(content)), m._state("DeserializeFMUState")
    for _ in range(2):  # the second call frees the state of the first
        assert m.call(name, content, size, C.byref(room)) == OK
        assert m.restore(room) == OK
    m.run(U[:3])
    state = m.save()
    held, before = C.c_void_p(state.value), m.serialize(state)
    assert m.call(name, b"x" + content[1:], size, C.byref(held)) == ERROR
    assert m.call(name, content[:-1] + b"x", size, C.byref(held)) == ERROR
    forged_run = forged(content, HEADER + 8, struct.pack("<i", 99))
    assert m.call(name, forged_run, size, C.byref(held)) == ERROR
    assert (held.value, m.serialize(state)) == (state.value, before), "a refused call changes no state"


def test_states_are_freed_in_any_order(make: Make) -> None:
    m: Master = make()
    m.initialize()
    states = [m.save() for _ in range(5)]
    for k in (2, 4, 0, 3, 1):
        assert m.forget(states[k]) == OK
        left = [s for s in states[:k] if m.restore(s) == OK]
        assert len(left) == len([j for j in range(k) if (2, 4, 0, 3, 1).index(j) > (2, 4, 0, 3, 1).index(k)])


def test_references_beyond_the_derivatives_are_unknown(make: Make, fmi: int) -> None:
    m: Events = make(mixed(), "me")
    m.begin(np.array([0.3]))
    first, name = sum(p.size for p in m.graph.ports) + 1, "GetReal" if fmi == 2 else "GetFloat64"
    rest = () if fmi == 2 else (C.c_size_t(1),)

    def get(reference: int) -> int:
        return m.call(name, (C.c_uint * 1)(reference), C.c_size_t(1), (C.c_double * 1)(), *rest)

    assert [get(first + k) for k in range(4)] == [OK] * 4
    for reference in (first + 4, first + 5, first + 6, 2**32 - 1):
        assert get(reference) == ERROR
        assert m.messages.pop()[2] == f"fmi{fmi}{name}: no variable has the value reference {reference}."
    assert get(first - 1) == (OK if fmi == 3 else ERROR), "the time is a variable of FMI 3.0 alone"


def test_the_clock_may_be_off_by_sixteen_units_in_the_last_place(make: Make) -> None:
    t0, h = 2.0**20, 2.0**-20  # a thousandth of the step is far below
    unit = 2.0**-32
    for sign in (1, -1):
        m: Master = make()
        m.initialize(t0)
        allowed = 16 * unit + 1e-3 * h
        for off, good in [(allowed - unit, True), (allowed + unit, False)]:
            state = m.save()
            assert m.step(t0 + sign * (off // unit) * unit, h) == (OK if good else ERROR), off
            assert m.restore(state) == OK


@pytest.mark.parametrize(("block", "name", "value"), [
    ("creep", "T", 0.37), ("transfer_function", "b", 2.5), ("lead_lag", "T_p", 0.011), ("pid", "Ki", 71.0),
    ("disturbance_observer", "f_n", 37.0), ("sliding_mode", "eta", 0.07),
])  # fmt: skip
def test_a_parameter_acts_from_the_next_step_with_all_that_follows_from_it(
    make: Make, block: str, name: str, value: float
) -> None:
    graph = single(block)
    port = next(p for p in graph.ports if p.name == name)
    kind = port.kind
    m, unit = make(graph), Unit(graph)
    inputs = [p.name for p in graph.ports if p.kind == "input"]
    outputs = [p.name for p in graph.ports if p.kind == "output"]
    late = kind == "param"
    new = [value * (1 + k) for k in range(port.size)]
    if not late:
        assert m.set(name, *new) == OK
        unit.set(name, new if port.size > 1 else new[0])
    m.initialize()
    unit.initialize(0.0)
    rng, moved, saved = np.random.default_rng(1), set(), None
    for k in range(8):
        if late and k == 4:
            saved = m.save(), unit.state
            assert m.set(name, *new) == OK
            unit.set(name, new if port.size > 1 else new[0])
        for i in inputs:
            v = rng.normal(size=next(p.size for p in graph.ports if p.name == i))
            assert m.set(i, *v) == OK
            unit.set(i, v.tolist() if len(v) > 1 else float(v[0]))
        assert m.step(k * H) == OK
        unit.do_step(k * H, H)
        got = [m.get(o) for o in outputs]
        assert got == [unit.get(o) if np.ndim(unit.get(o)) == 0 else list(unit.get(o)) for o in outputs]
        moved.add(str(got))
    assert len(moved) == 8
    if saved:
        assert m.restore(saved[0]) == OK
        unit.state = saved[1]
        assert [m.get(n) for n in (name, *outputs)] == [unit.get(n) for n in (name, *outputs)]


# ---- serialized states from outside ----------------------------------------------------------------------------------
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
