"""Instances begin with a name, end without a trace, and keep their promises at the limits of times and steps."""

from __future__ import annotations

import ctypes as C
import gc
import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fmu_events import Events
from fmu_master import ERROR, OK, Master, mixed

Make = Callable[..., Master]
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


class Used(C.Structure):
    """`struct mallinfo2` of glibc."""

    _fields_ = [
        *((n, C.c_size_t) for n in ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks")),
        *((n, C.c_size_t) for n in ("uordblks", "fordblks", "keepcost")),
    ]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="counts the memory of glibc")
@pytest.mark.parametrize("interface", ["cs", "me"])
def test_an_instance_leaves_no_memory_behind(make: Make, folder: Path, fmi: int, interface: str) -> None:
    """States that were not freed too, and instances that could not be made."""
    libc = C.CDLL(None)
    if not hasattr(libc, "mallinfo2"):
        pytest.skip("the C library counts no memory")
    libc.mallinfo2.restype = Used
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

    def used() -> int:
        gc.collect()  # instances and their callbacks refer to each other
        now = libc.mallinfo2()
        return int(now.uordblks + now.hblkhd)

    for _ in range(3):
        live()
    least = []
    for _ in range(3):  # what Python allocates meanwhile is not the same every time
        before = used()
        for _ in range(15):
            live()
        least.append(used() - before)
    assert min(least) < 15 * 24, "the least that malloc gives, as often"
    assert m.c.value


# ---- times ----------------------------------------------------------------------------------------------------------
def test_the_longest_step(make: Make) -> None:
    m = make()
    m.initialize()
    assert m.step(0.0, 1e9) == OK
    assert m.step(1e9, math.nextafter(1e9, math.inf)) == ERROR
    assert m.messages.pop()[2] == "The step size must be in (0, 1e9] s. Got 1000000000 instead."


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
    assert "after the stop time" in m.messages.pop()[2]
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
