"""Instances: initialisation, reset, what they log, where their block file is, and that they leave no trace behind."""

import ctypes as C
import itertools
import math
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from fmu_events import Events
from fmu_master import DISCARD, ERROR, OK, WARNING, H, Make, Master, U, mixed, single
from heap import leaves_nothing

NEEDS_NAME = "The instance needs a name."


@pytest.mark.parametrize("name", [None, b"", b" ", b"\t\r\n "])
def test_an_instance_needs_a_name(make: Make, name: bytes | None) -> None:
    m = make().another(name=name)
    assert m.c.value is None
    assert m.messages == [(ERROR, "logStatusError", NEEDS_NAME)]


def test_the_name_comes_with_the_messages_of_fmi_2(make: Make, fmi: int) -> None:
    m = make().another(name=b" plant 7 ")
    assert m.step(0.0) == ERROR
    assert m.names == [b" plant 7 "] * (fmi == 2)
    m.free()


def test_logging_from_the_start_tells_of_the_instance(make: Make) -> None:
    quiet, m = make().another(), make().another(logging=True)
    n = len(m.graph.ports)
    assert quiet.messages == []
    assert m.messages == [(OK, "logEvents", f"Instantiated: 1 blocks, {n} variables.")]
    quiet.free(), m.free()


def test_a_token_must_be_that_of_the_block_file(make: Make) -> None:
    m = make()
    for token, shown in [(None, ""), (b"{0}", "{0}")]:
        wrong = m.another(token=token)
        assert wrong.c.value is None
        said = f"The token '{shown}' of modelDescription.xml does not belong to this block.bin ('{m.token}')."
        assert wrong.messages == [(ERROR, "logStatusError", said)]


def test_without_callbacks_nothing_is_said(make: Make, fmi: int) -> None:
    m = make()
    if fmi == 2:
        where = m.resources.as_uri().encode()
        c = C.c_void_p(m.lib.fmi2Instantiate(b"i", 1, m.token.encode(), where, None, 0, 1))
    else:
        where = f"{m.resources}/".encode()
        rest = (0, 1, 0, 0, None, C.c_size_t(0), None, None, None)
        c = C.c_void_p(m.lib.fmi3InstantiateCoSimulation(b"i", m.token.encode(), where, *rest))
    assert c.value
    m.c, own = c, m.c
    assert m.step(0.0) == ERROR
    m.free()
    m.c = own
    assert m.messages == []


@pytest.mark.some(1)
@pytest.mark.parametrize("interface", ["cs", "me"])
def test_an_instance_leaves_no_memory_behind(make: Make, folder: Path, fmi: int, interface: str) -> None:
    """States that were not freed too, and instances that could not be made."""
    graph = mixed()
    m = make(graph, interface)
    target = folder / graph.token
    kind = Master if interface == "cs" else Events

    def live() -> None:
        one = kind(graph, target, fmi, interface=interface)
        one.initialize()
        one.save(), one.save()
        one.free()
        assert kind(graph, target, fmi, token="{0}", interface=interface).c.value is None

    assert leaves_nothing(live)
    assert m.c.value


# ---- times ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("t0", [0.0, 4096.0, -4096.0])
def test_a_thousandth_of_a_step_is_rounding_of_the_clock(make: Make, t0: float) -> None:
    """Both at the start of a step and at the stop time; steps of 1/16 s have exact times."""
    m, h = make(), 0.0625
    m.initialize(t0, stop=t0 + 8 * h)
    for sign in (1, -1):
        state = m.save()
        assert m.step(t0 + sign * 0.99e-3 * h, h) == OK
        assert m.restore(state) == OK
        assert m.step(t0 + sign * 1.01e-3 * h, h) == ERROR
        assert "but the unit is at t = " in m.messages.pop()[2]
    for k in range(7):
        assert m.step(t0 + k * h, h) == OK
    last = t0 + 7 * h
    assert m.step(last, h * 1.0011) == ERROR
    assert m.messages.pop()[2].endswith(f" s, after the stop time {t0 + 8 * h:g} s.")
    assert m.step(last, h * 1.0009) == OK


def test_start_and_stop_times(make: Make) -> None:
    refused = [(1.0, math.nextafter(1.0, 0)), (0.0, math.inf), (0.0, math.nan)]
    for start, stop, good in [(0.0, 0.0, True), *((*times, False) for times in refused)]:
        m = make()
        assert m.enter(start, stop) == (OK if good else ERROR)
        assert [t[2] for t in m.messages] == [
            "The stop time must be finite and not before the start time." for _ in range(not good)
        ]
    m = make()
    for bad in (math.inf, math.nan):
        assert m.enter(bad) == ERROR
        assert m.messages[-1][2] == "The start time must be finite."
    assert m.enter(0.0, 1.0) == OK


# ---- derivatives ----------------------------------------------------------------------------------------------------
def test_repeated_variables_add_their_seeds(make: Make, fmi: int) -> None:
    m = make()
    m.initialize()
    y, u = m.ports["y"].reference, m.ports["u"].reference
    slope = m.tangent([y], [u], np.ones(1), 1)[1][0]
    assert slope != 0
    assert m.tangent([y], [u, u], np.array([0.75, 0.5]), 1)[1].tolist() == [1.25 * slope]
    assert m.tangent([y, y], [u], np.array([2.0]), 2)[1].tolist() == [2 * slope] * 2
    if fmi == 3:
        assert m.tangent([y, y], [u], np.array([0.75, 0.5]), 1, "Adjoint")[1].tolist() == [1.25 * slope]
        for seeds, n in [(2, 1), (1, 2)]:
            assert m.tangent([y], [u], np.ones(seeds), n)[0] == ERROR
            assert m.messages[-1][2].endswith("the variables have 1 values. Got room for 2.")
    for unknowns, knowns, name, sort in [
        ([u], [u], "u", "an output or derivative"),
        ([y], [y], "y", "an input or continuous state"),
    ]:
        assert m.tangent(unknowns, knowns, np.ones(1), 1)[0] == ERROR
        assert m.messages[-1][2].endswith(f"DirectionalDerivative: '{name}' is not {sort} here.")


# ---- beside one another ----------------------------------------------------------------------------------------------
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


# ---- log categories --------------------------------------------------------------------------------------------------
NAMES = (b"logEvents", b"logStatusWarning", b"logStatusError")


def choose(m: Master, on: bool, *names: bytes | None) -> int:
    return m.call("SetDebugLogging", C.c_int(on), C.c_size_t(len(names)), (C.c_char_p * len(names))(*names))


def heard(m: Master) -> set[str]:
    """Return the categories in which a warning and an error are heard."""
    m.messages.clear()
    assert m.call("Terminate") == ERROR
    assert m.set("u", math.nan) == DISCARD
    assert m.set("u", 0.0) == OK
    for status, category, text in m.messages:
        assert text
        assert category == {WARNING: "logStatusWarning", ERROR: "logStatusError"}[status]
    return {x[1] for x in m.messages}


def after(names: tuple[bytes, ...]) -> set[str]:
    return {n.decode() for n in names} - {"logEvents"}


@pytest.mark.parametrize("n", [0, 1, 2, 3])
def test_exactly_the_chosen_categories_are_heard(make: Make, n: int) -> None:
    m = make()
    for names in itertools.permutations(NAMES, n):
        assert choose(m, False) == OK
        assert heard(m) == set()
        assert choose(m, True, *names) == OK
        assert heard(m) == after(names or NAMES), "without names it is all of them"
        assert choose(m, True) == OK
        assert choose(m, False, *names) == OK
        assert heard(m) == (after(tuple(x for x in NAMES if x not in names)) if names else set())


@pytest.mark.parametrize("names", [(b"logAll",), (NAMES[0], b"logAll"), (b"logAll", NAMES[0])])
def test_log_all_is_every_category_wherever_it_stands(make: Make, names: tuple[bytes, ...]) -> None:
    m = make()
    assert choose(m, False) == OK
    assert choose(m, True, *names) == OK
    assert heard(m) == after(NAMES)
    assert choose(m, False, *names) == OK
    assert heard(m) == set()


@pytest.mark.parametrize("wrong", [b"nonsense", b"", b"logEvent", b"logEventss", None])
@pytest.mark.parametrize("first", [(), (b"logAll",), NAMES[:1]])
def test_a_wrong_name_changes_nothing_wherever_it_stands(
    make: Make, wrong: bytes | None, first: tuple[bytes, ...]
) -> None:
    m = make()
    assert choose(m, True, b"logStatusError") == OK
    for names in ((*first, wrong), (wrong, *first)):
        assert choose(m, True, *names) == ERROR
        shown = (wrong or b"").decode()
        assert m.messages[-1] == (ERROR, "logStatusError", f"fmi{m.fmi}SetDebugLogging: no log category '{shown}'.")
        assert heard(m) == {"logStatusError"}
        assert choose(m, False, *names) == ERROR
        assert heard(m) == {"logStatusError"}


def test_an_instance_begins_with_warnings_and_errors(make: Make) -> None:
    assert heard(make()) == after(NAMES)


# ---- the block file --------------------------------------------------------------------------------------------------
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


@pytest.mark.parametrize(("location", "sentence"), [
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
])  # fmt: skip
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
    m.c = m.instantiate(location)
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
    assert not m.instantiate(location).value
    assert m.messages == [(ERROR, "logStatusError", f"cannot read '{alone.parent}/../../resources/block.bin'")]


@pytest.mark.parametrize("damage", ["cut", "flip", "empty", "version", "huge"])
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
        content[8] += damage == "version"
    file.write_bytes(content)
    if damage == "huge":
        os.truncate(file, 2**30 + 1)  # takes no room on the disk, and must take none in memory
    m = Master(single("prandtl_ishlinskii"), tmp_path, fmi)
    assert not m.c.value
    assert len(m.messages) == 1
    expected = {"cut": "length", "flip": "checksum", "version": "version"}.get(damage, "cannot read")
    assert expected in m.messages[0][2]
