"""Invalid steps and values, parameters, reset, instances: a refused call changes nothing and gives the reason."""

from __future__ import annotations

import ctypes as C
import math
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fmu_master import DISCARD, ERROR, OK, WARNING, H, Master, loop, rows, single

from hystfmu.graph import Graph, Node

Make = Callable[..., Master]
U = rows(single("prandtl_ishlinskii"))[:, 0]


# ---- steps ----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("h", [0.0, -0.0, -5.7e-15, -1e-3, math.nan, math.inf, -math.inf, 1e9 + 0.5, 1e300])
def test_bad_step_size(make: Make, h: float) -> None:
    m = make()
    m.initialize()
    m.run(U[:5])
    before = m.memory()
    assert m.step(5 * H, h) == ERROR
    assert m.memory() == before
    assert m.messages[-1][2].startswith("The step size must be in (0, 1e9] s. Got ")
    assert m.step(5 * H) == OK


@pytest.mark.parametrize("h", [5e-324, 1e-300, 5.7e-15, 9e-13])
def test_residue_of_a_clock_is_no_step(make: Make, h: float) -> None:
    """Importers that add up their steps ask for the rest to the stop time; below 1e-12 s, it is rounding."""
    want, m = make(), make()
    for unit in (want, m):
        unit.initialize(stop=1.0)
    got, before = m.run(U[:20]), m.memory()
    assert m.step(20 * H, h) == OK
    assert m.step(20 * H, h) == OK
    assert (m.memory(), m.messages) == (before, [])
    got += m.run(U[20:40], first=20)
    assert got == want.run(U[:40])
    assert m.memory() == want.memory()


@pytest.mark.parametrize(("t", "stop"), [(1e6, None), (1e6, 2e6), (0.0, 2e6), (1e6, 1e6), (-2e6, 0.0), (1e16, None)])
def test_residue_follows_the_size_of_the_times(make: Make, t: float, stop: float | None) -> None:
    """A few units in the last place of the larger of |t| and the stop time: 2^-53 is half of one, relative to it."""
    m = make()
    m.initialize(t, stop)
    before = m.memory()
    last = 2.0**-52 * max(abs(t), abs(stop or 0.0))
    assert m.step(t, 8 * last) == OK
    assert m.memory() == before
    if stop != t:
        assert m.step(t, 1e4 * last) == OK
        assert m.memory() != before


@pytest.mark.parametrize("n", [1000, 100_000])
def test_a_clock_that_adds_its_steps_reaches_the_stop_time(make: Make, n: int) -> None:
    """The stop time is n steps; the last step is what the sum of n steps lacks (if it exceeds the stop time: none)."""
    m, h = make(), 1.0 / n + 1e-18
    stop = n * h
    m.initialize(stop=stop)
    t = 0.0
    while stop - t > 0:
        step = min(h, stop - t)
        assert m.step(t, step) == OK, (t, step, m.messages)
        t += step


def test_real_steps_of_such_a_size_are_refused(make: Make) -> None:
    """A run in steps below 1e-12 s does not stand still unnoticed: its clock leaves that of the unit."""
    m = make()
    m.initialize()
    statuses = [m.step(k * 1e-13, 1e-13) for k in range(20)]
    assert statuses[0] == OK
    assert ERROR in statuses
    assert m.messages[0][2].endswith("but the unit is at t = 0 s.")


def test_residue_at_another_time(make: Make) -> None:
    m = make()
    m.initialize()
    m.run(U[:5])
    assert m.step(4 * H, 5.7e-15) == ERROR
    assert m.messages[-1][2].endswith("but the unit is at t = 0.005 s.")


@pytest.mark.parametrize("t", [0.0, 4 * H, 6 * H, math.nan, math.inf, -math.inf])
def test_step_from_another_time(make: Make, t: float) -> None:
    m = make()
    m.initialize()
    m.run(U[:5])
    before = m.memory()
    assert m.step(t) == ERROR
    assert m.memory() == before
    assert m.messages[-1][2].endswith("but the unit is at t = 0.005 s.")


@pytest.mark.parametrize("h", [1e-3, 1 / 60, 1 / 44100, 0.1])
@pytest.mark.parametrize("t0", [0.0, 1e6])
def test_rounding_of_time_is_accepted(make: Make, h: float, t0: float) -> None:
    """Importers compute times by products or by sums; the test covers the last 200 steps of a long run."""
    m = make(Graph.single(Node("delay", "delay", {"n": 2}, {})))
    n = 10**7
    m.initialize(t0 + (n - 200) * h)
    for k in range(n - 200, n - 100):
        assert m.step(t0 + k * h, h) == OK
    added = t0 + (n - 100) * h
    for _ in range(100):
        assert m.step(added, h) == OK
        added += h


def test_step_beyond_the_stop_time(make: Make) -> None:
    m = make()
    m.initialize(stop=3 * H)
    for k in range(3):
        assert m.step(k * H) == OK
    assert m.step(3 * H) == ERROR
    assert m.messages[-1][2] == "The step ends at t = 0.004 s, after the stop time 0.003 s."


def test_bad_start_and_stop_time(make: Make) -> None:
    for t, stop in ((math.nan, None), (math.inf, None), (1.0, 0.5), (0.0, math.nan)):
        m = make()
        assert m.enter(t, stop) == ERROR
        assert m.enter(0.0, 1.0) == OK


# ---- inputs without a value -----------------------------------------------------------------------------------------
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_input_without_finite_value(make: Make, bad: float) -> None:
    want, m = make(), make()
    want.initialize()
    m.initialize()
    first = want.run(U[:40])
    got = m.run(U[:20])
    before = m.memory()
    for _ in range(3):
        assert m.set("u", bad) == DISCARD
        assert m.step(20 * H) == DISCARD
    assert m.memory() == before, "the memory advanced with an invalid input"
    word = "NaN" if math.isnan(bad) else "infinite"
    text = f"The input 'u' is {word}: no step is made until it has a finite value again."
    assert m.messages == [(WARNING, "logStatusWarning", text)], "one warning"
    got += m.run(U[20:40], first=20)
    assert got == first, "full recovery"
    assert m.set("u", bad) == DISCARD
    assert len(m.messages) == 2, "a new episode warns again"


# ---- values ---------------------------------------------------------------------------------------------------------
def test_out_of_range(make: Make) -> None:
    m = make()
    before = m.memory()
    assert m.set("r", *[0.1] * 9, -1.0) == ERROR
    assert m.messages[-1] == (
        ERROR,
        "logStatusError",
        "The 'r' parameter of prandtl_ishlinskii must be a float in [0, inf). Got -1 instead.",
    )
    assert m.set("w", *[math.nan] * 10) == ERROR
    assert m.messages[-1][2].endswith("Got nan instead.")
    assert m.memory() == before, "none of the values is set when one is refused"


def test_types(make: Make) -> None:
    """Types are checked, and an enumeration has only its items as values."""
    m = make(single("reference"))
    last = len(m.ports["shape"].var.choices) - 1
    assert m.set("shape", last) == OK
    assert m.set("shape", last + 1) == ERROR
    assert m.set("shape", -1) == ERROR
    assert m.set("seed", 12) == OK
    assert m.enter() == OK
    assert (m.get("shape"), m.get("seed")) == (last, 12)
    name, ctype = ("GetReal", C.c_double) if m.fmi == 2 else ("GetInt32", C.c_int32)
    extra = () if m.fmi == 2 else (C.c_size_t(1),)
    assert m.call(name, (C.c_uint * 1)(m.ports["shape"].reference), C.c_size_t(1), (ctype * 1)(), *extra) == ERROR
    assert m.messages[-1][2] == f"fmi{m.fmi}{name}: 'shape' is of type enumeration."


def test_unknown_reference(make: Make, fmi: int) -> None:
    m = make()
    m.initialize()
    total = sum(p.size for p in m.graph.ports)
    name = "GetReal" if fmi == 2 else "GetFloat64"
    for reference in (total + 1, 2**32 - 1):
        one, value = (C.c_uint * 1)(reference), (C.c_double * 1)()
        extra = () if fmi == 2 else (C.c_size_t(1),)
        assert m.call(name, one, C.c_size_t(1), value, *extra) == ERROR
        assert m.messages[-1][2] == f"fmi{fmi}{name}: no variable has the value reference {reference}."


def test_time_and_array_counts_in_fmi3(make: Make, fmi: int) -> None:
    if fmi == 2:
        pytest.skip("FMI 2.0 has neither arrays nor a variable for the time")
    m = make()
    m.initialize(t=2.0)
    m.step(2.0)
    reference = sum(p.size for p in m.graph.ports)
    value = (C.c_double * 11)()
    assert m.call("GetFloat64", (C.c_uint * 1)(reference), C.c_size_t(1), value, C.c_size_t(1)) == OK
    assert value[0] == 2.0 + H
    r = m.ports["r"].reference
    both = (C.c_uint * 2)(r, reference)
    assert m.call("GetFloat64", both, C.c_size_t(2), value, C.c_size_t(11)) == OK
    assert list(value) == [*m.graph.nodes[0].value("r"), 2.0 + H]
    assert m.call("GetFloat64", both, C.c_size_t(2), value, C.c_size_t(10)) == ERROR
    assert m.messages[-1][2] == "fmi3GetFloat64: the variables have 11 values. Got room for 10."
    assert m.call("GetFloat64", (C.c_uint * 1)(r + 1), C.c_size_t(1), value, C.c_size_t(1)) == ERROR
    assert m.call("SetFloat64", (C.c_uint * 1)(reference), C.c_size_t(1), value, C.c_size_t(1)) == ERROR


def test_outputs_cannot_be_set(make: Make) -> None:
    m = make()
    m.initialize()
    assert m.set("y", 1.0) == ERROR
    assert m.messages[-1][2] == "'y' is an output and cannot be set."


def test_fixed_and_tunable(make: Make) -> None:
    fixed = make()
    assert fixed.set("u0", 0.2) == OK
    assert fixed.enter() == OK
    assert fixed.set("u0", 0.3) == OK
    assert fixed.call("ExitInitializationMode") == OK
    before = fixed.memory()
    assert fixed.set("u0", 0.4) == ERROR
    assert fixed.memory() == before
    assert fixed.messages[-1][2] == "'u0' is a fixed parameter: set it before the initialisation ends."
    tunable = make(single("backlash_sum"))
    tunable.initialize()
    assert tunable.set("w0", 3.0) == OK
    assert tunable.set("u", 0.0) == OK
    assert tunable.step(0.0) == OK
    before_y = tunable.get("y")
    assert tunable.set("u", 1e-9) == OK
    assert tunable.step(H) == OK
    assert tunable.get("y") - before_y == pytest.approx(3e-9, rel=1e-6)


def test_parameters_that_do_not_fit_together(make: Make) -> None:
    """Each value is valid but their combination is not: the initialisation fails and can be repeated."""
    m = make()
    assert m.set("r", *np.linspace(0.9, 0.0, 10)) == OK
    assert m.enter() == OK
    assert m.call("ExitInitializationMode") == ERROR
    assert m.messages[-1][2].startswith("the parameters do not fit together at prandtl_ishlinskii: ")
    assert m.set("r", *np.linspace(0.0, 0.9, 10)) == OK
    assert m.call("ExitInitializationMode") == OK


# ---- initialisation -------------------------------------------------------------------------------------------------
def test_outputs_follow_inputs_in_initialization_mode(make: Make) -> None:
    m = make()
    assert m.enter() == OK
    seen = []
    for u in (0.0, 2.0, -1.0, 2.0):
        assert m.set("u", u) == OK
        seen.append((m.get("y"), m.get("y")))
    assert seen[1] == seen[3], "the memory is initialised anew for every guess"
    assert [a == b for a, b in seen] == [True] * 4
    assert seen[1][0] == m.graph.run([2.0, 2.0])[0]


def test_get_and_set_have_no_side_effects(make: Make) -> None:
    plain, busy = make(), make()
    for m in (plain, busy):
        m.initialize()
    want = plain.run(U[:50])
    got = []
    for k, u in enumerate(U[:50]):
        for guess in (3.0, -3.0, float(u)):
            assert busy.set("u", guess) == OK
            busy.get("y")
        assert busy.step(k * H) == OK
        got.append(busy.get("y"))
    assert got == want


# ---- instances ------------------------------------------------------------------------------------------------------
def test_reset_gives_a_new_instance(make: Make) -> None:
    new, used = make(), make()
    used.set("u0", 0.3)
    used.set("w0", 2.0)
    used.initialize(t=7.0)
    used.set("u", 1.0)
    assert used.step(7.0) == OK
    used.set("u", math.nan)
    assert used.call("Reset") == OK
    assert used.memory() == new.memory()
    for m in (new, used):
        m.initialize()
    assert used.run(U[:30]) == new.run(U[:30])


def test_instances_are_independent(make: Make) -> None:
    a, b, alone = make(), make(), make()
    for m in (a, b, alone):
        m.initialize()
    want = alone.run(U[:40])
    got = []
    for k, u in enumerate(U[:40]):
        got += a.run([u], first=k)
        b.run([-2 * u], first=k)
    assert got == want


def test_many_instances(make: Make, folder: Path) -> None:
    graph = single("backlash_sum")
    many = [make(graph) for _ in range(1000)]
    assert len({m.c.value for m in many}) == 1000


def test_two_different_fmus_in_one_process(make: Make) -> None:
    a, b = make(single("backlash_sum")), make(loop())
    a.initialize()
    b.initialize()
    y = [(a.set("u", 0.01 * k), b.step(k * H), a.step(k * H), a.get("y"), b.get("y"))[3:] for k in range(20)]
    b2 = make(loop())
    b2.initialize()
    assert [v for _, v in y] == [(b2.step(k * H), b2.get("y"))[1] for k in range(20)]


# ---- location of the block file -------------------------------------------------------------------------------------
def _spellings(resources: Path, fmi: int) -> list[str]:
    uri = resources.as_uri()
    return [
        uri,
        uri + "/",
        uri.replace("file://", "file:"),
        uri.replace("file:///", "file://localhost/"),
        uri.replace("file:///", "FILE:///"),
        uri.replace("file:///", "File:/"),
        uri.replace("file:///", "FILE://LOCALHOST/"),
        uri.replace("file:///", "file://LocalHost/"),
        "FILE://" + "".join(f"%{b:02x}" if b != ord("/") else "/" for b in str(resources).encode()),
        str(resources),
    ]


def test_paths_with_spaces_and_non_ascii(tmp_path: Path, fmi: int) -> None:
    folder = tmp_path / "Größe 50% µm #1 日本"
    m = Master(single("prandtl_ishlinskii"), folder, fmi)
    resources = m.resources
    m.free()
    plain = [str(resources), f"{resources}/"]
    for location in [*plain, *(_spellings(resources, fmi))]:
        m = Master(single("prandtl_ishlinskii"), folder, fmi, location=location)
        assert m.c.value, (location, m.messages)
        m.free()


@pytest.mark.parametrize(
    ("location", "sentence"),
    [
        ("file:///no/such/folder", "cannot read '/no/such/folder/block.bin'"),
        ("/no/such/folder/", "cannot read '/no/such/folder/block.bin'"),
        ("file:///a%zz", "the resource location has a malformed % escape: 'file:///a%zz'"),
        ("file:///a%00b", "the resource location has a malformed % escape: 'file:///a%00b'"),
        ("file:///a%4", "the resource location has a malformed % escape: 'file:///a%4'"),
        ("file://server/a", "the resource location names another machine: 'file://server/a'"),
        ("FILE://LOCALHOSTS/a", "the resource location names another machine: 'FILE://LOCALHOSTS/a'"),
        ("files:/a", "cannot read 'files:/a/block.bin'"),
        ("file:a/b", "cannot read 'a/b/block.bin'"),
        ("file:no/such", "cannot read 'no/such/block.bin'"),
        ("file:a//localhost/b", "cannot read 'a//localhost/b/block.bin'"),
        ("file:/a//b", "cannot read '/a//b/block.bin'"),
        ("file:/", "cannot read '/block.bin'"),
        ("file:///", "cannot read '/block.bin'"),
        ("file://localhost/", "cannot read '/block.bin'"),
        ("file://a", "the resource location names another machine: 'file://a'"),
        ("file:/%41%5a%61%7A%30%39", "cannot read '/AZaz09/block.bin'"),
        ("file:/%4g", "the resource location has a malformed % escape: 'file:/%4g'"),
        ("file:/%4G", "the resource location has a malformed % escape: 'file:/%4G'"),
        ("file:/%/a", "the resource location has a malformed % escape: 'file:/%/a'"),
        ("file:/%:0", "the resource location has a malformed % escape: 'file:/%:0'"),
        ("file:/%@0", "the resource location has a malformed % escape: 'file:/%@0'"),
        ("file:/%`0", "the resource location has a malformed % escape: 'file:/%`0'"),
        ("/a%41", "cannot read '/a%41/block.bin'"),
        ("no/such", "cannot read 'no/such/block.bin'"),
    ],
)
def test_bad_location(folder: Path, fmi: int, location: str, sentence: str) -> None:
    graph = single("prandtl_ishlinskii")
    m = Master(graph, folder / graph.token, fmi, location=location)
    assert not m.c.value
    said = sentence.replace("%", "%%") if fmi == 2 else sentence  # FMI 2.0 messages are printf formats
    assert m.messages == [(ERROR, "logStatusError", said)]


NOWHERE = [None, b"", b"file:", b"FILE://", b"file://LocalHost"]


@pytest.mark.parametrize("location", NOWHERE)
def test_a_binary_finds_its_own_resources(tmp_path: Path, fmi: int, location: bytes | None) -> None:
    m = Master(single("prandtl_ishlinskii"), tmp_path / "Größe 50% µm #1 日本", fmi)
    m.initialize()
    want = m.run(U[:20])
    m.free()
    m.c = m._instantiate(location)
    assert m.c.value, m.messages
    m.initialize()
    assert m.run(U[:20]) == want
    m.free()


@pytest.mark.parametrize("location", NOWHERE)
def test_a_binary_that_has_left_its_fmu(tmp_path: Path, fmi: int, location: bytes | None) -> None:
    m = Master(single("prandtl_ishlinskii"), tmp_path, fmi)
    m.free()
    alone = tmp_path / "a" / "b" / "alone.so"
    alone.parent.mkdir(parents=True)
    shutil.copy(m.lib._name, alone)
    m.lib = C.CDLL(str(alone))
    assert not m._instantiate(location).value
    assert m.messages == [(ERROR, "logStatusError", f"cannot read '{alone.parent}/../../resources/block.bin'")]


def test_wrong_token(folder: Path, fmi: int) -> None:
    graph = single("prandtl_ishlinskii")
    m = Master(graph, folder / graph.token, fmi, token="{other}")
    assert not m.c.value
    assert m.messages[0][2].startswith("The token '{other}' of modelDescription.xml does not belong to this block.bin")


@pytest.mark.parametrize("damage", ["cut", "flip", "empty", "version"])
def test_damaged_block_file(tmp_path: Path, fmi: int, damage: str) -> None:
    m = Master(single("prandtl_ishlinskii"), tmp_path, fmi)
    m.free()
    file = m.resources / "block.bin"
    content = bytearray(file.read_bytes())
    if damage == "cut":
        del content[-3:]
    elif damage == "flip":
        content[-1] ^= 1
    elif damage == "empty":
        content.clear()
    else:
        content[8] += 1
    file.write_bytes(content)
    m = Master(single("prandtl_ishlinskii"), tmp_path, fmi)
    assert not m.c.value
    assert len(m.messages) == 1
    expected = {"cut": "length", "flip": "checksum", "empty": "cannot read", "version": "version"}[damage]
    assert expected in m.messages[0][2]


# ---- messages -------------------------------------------------------------------------------------------------------
def test_log_categories(make: Make) -> None:
    m = make()

    def choose(on: bool, *names: bytes) -> int:
        listed = (C.c_char_p * len(names))(*names)
        return m.call("SetDebugLogging", C.c_int(on), C.c_size_t(len(names)), listed)

    assert choose(False) == OK
    assert m.step(0.0) == ERROR
    assert m.messages == []
    assert choose(True, b"logStatusWarning") == OK
    assert m.step(0.0) == ERROR
    assert m.messages == []
    assert choose(True, b"logStatusError") == OK
    assert m.step(0.0) == ERROR
    assert len(m.messages) == 1
    assert choose(True, b"logStatusError", b"nonsense") == ERROR
    assert m.messages[-1][2] == f"fmi{m.fmi}SetDebugLogging: no log category 'nonsense'."
