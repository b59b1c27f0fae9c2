"""Times and lengths of steps, and inputs without a value: a refused step changes nothing and gives the reason."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from fmu_master import DISCARD, ERROR, OK, WARNING, H, Master, rows, single

from hystfmu.graph import Graph, Node

Make = Callable[..., Master]
U = rows(single("prandtl_ishlinskii"))[:, 0]


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
