"""Log categories: which messages come after which choice, alone, together and with "logAll"."""

from __future__ import annotations

import ctypes as C
import itertools
import math
from collections.abc import Callable

import pytest
from fmu_master import DISCARD, ERROR, OK, WARNING, Master

Make = Callable[..., Master]
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
