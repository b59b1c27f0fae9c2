"""A source follows the steps, not the rounding of an importer's clock; a step that is no step of the model keeps its t.

Expected values are those of an instance that is stepped at start + k h, or the closed form of the sine.
"""

import math

import pytest
from fmu_master import OK, H, Make, Master

from hystfmu.graph import Graph, Node
from hystfmu.unit import Unit

AMPLITUDE, FREQUENCY = 0.8, 7.0
SINE = Node("ref", "reference", {}, {"amplitude": AMPLITUDE, "frequency": FREQUENCY})


def source(step: float = H) -> Graph:
    return Graph.single(SINE).with_step(step)


def added(start: float, h: float, n: int) -> list[float]:
    """Times of a clock that adds up its steps."""
    times = [start]
    for _ in range(n - 1):
        times.append(times[-1] + h)
    return times


def stepped(m: Master, times: list[float], h: float = H) -> list[float]:
    """Outputs after steps of h from these times."""
    found = []
    for t in times:
        assert m.step(t, h) == OK
        found.append(m.get("r"))
    return found


@pytest.mark.parametrize(
    ("start", "h", "n"),
    [(0.0, H, 100_000), (0.7, H, 3000), (-3.1, H, 5000), (1e4, 1 / 3000, 5000)],
)
def test_a_clock_that_adds_up_gives_the_bits_of_one_that_counts(make: Make, start: float, h: float, n: int) -> None:
    m = {name: make(source(h)) for name in ("adds", "counts")}
    times = {"adds": added(start, h, n), "counts": [start + k * h for k in range(n)]}
    assert times["adds"] != times["counts"]
    for one in m.values():
        one.initialize(start)
    got = {name: stepped(m[name], times[name], h) for name in m}
    assert got["adds"] == got["counts"]
    unit = Unit(source(h))
    unit.initialize(start)
    for t, want in zip(times["adds"][:3000], got["counts"], strict=False):
        unit.do_step(t, h)
        assert unit.get("r") == want


def test_it_does_so_from_a_saved_state_on(make: Make) -> None:
    m, other = make(source()), make(source())
    times = added(0.1, H, 4000)
    m.initialize(0.1)
    stepped(m, times[:1000])
    content = m.serialize(m.save())
    want = stepped(m, times[1000:])
    status, state = other.deserialize(content)
    assert status == OK
    assert other.restore(state) == OK, "the start time is part of the state"
    assert stepped(other, [0.1 + k * H for k in range(1000, 4000)]) == want


def closed(t: float) -> float:
    return AMPLITUDE * math.sin(2 * math.pi * FREQUENCY * t)


@pytest.mark.parametrize("offset", [1e-9, 1e-4, 0.3])
def test_a_clock_beside_the_steps_keeps_its_times(make: Make, offset: float) -> None:
    """A first step that is longer by a share of H: what follows is no multiple of H, nor rounding of one."""
    m = make(source())
    m.initialize()
    assert m.step(0.0, H * (1 + offset)) == OK
    t = H * (1 + offset)
    for _ in range(100):
        assert m.step(t, H) == OK
        t += H
        assert m.get("r") == pytest.approx(closed(t), abs=1e-14)


def test_a_step_of_another_length_ends_where_it_says(make: Make) -> None:
    m = make(source())
    m.initialize()
    t = 0.0
    for h in [H / 3, H / 3, H / 3, H / 2, H / 2, H * (1 + 1e-9)] * 50:
        assert m.step(t, h) == OK
        t += h
        assert m.get("r") == pytest.approx(closed(t), abs=1e-14)
        if m.fmi == 3:
            assert m.last_time.value == t
