"""Minor loops row by row, and the class of memory at each limit that `minor_loops` states."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from hystfmu.data.reversals import turning_points
from hystfmu.identify.excitation import minor_loops
from hystfmu.identify.excitation.minor_loops import NONE, OPEN_LOOPS, RETURN_POINT, UNKNOWN, examine

SEED = int(np.random.default_rng().integers(1 << 31))


def gaps_by_rows(u, y, turns):
    """Walk on from every extremum: the branch back must not leave the one that led there, and is 2 % deep."""
    found = []
    for before, at in pairwise(turns):
        side, depth = np.sign(u[at] - u[before]), 0.0
        for k in range(at + 1, len(u)):
            way = side * (u[k] - u[at])
            if way >= 0:
                if depth >= 0.02 * np.ptp(u):
                    found.append(np.interp(0.0, [side * (u[k - 1] - u[at]), way], [y[k - 1], y[k]]) - y[at])
                break
            depth = max(depth, -way)
            if depth > abs(u[at] - u[before]):
                break
    return found


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_gap_of_every_loop_that_closes(sign):
    print("seed", SEED)
    rng = np.random.default_rng(SEED)
    levels = rng.uniform(-1, 1, 41)
    u = sign * np.interp(np.arange(401), 10 * np.arange(41), levels)
    y, turns = rng.normal(size=401), turning_points(u, 0.0)
    want = gaps_by_rows(u, y, turns)
    assert len(want) > 2
    assert minor_loops.gaps(u, y, turns) == pytest.approx(want)


@pytest.mark.parametrize(("back", "count"), [(0.0, 1), (-1e-9, 0), (0.979, 1), (0.981, 0)])
def test_a_loop_is_inside_its_branch_and_two_percent_deep(back, count):
    u = np.interp(np.arange(41), [0, 10, 20, 30, 40], [0.2, 0, 1, back, 1.0])
    assert len(minor_loops.gaps(u, u, np.array([10, 20, 30]))) == count


def test_the_last_row_may_close_a_loop():
    u = np.array([0.5, 0.0, 1.0, 0.4, 0.5, 1.0])
    assert minor_loops.gaps(u, np.arange(6.0), np.array([1, 2, 3])).tolist() == [3.0]
    assert minor_loops.gaps(u[:-1], np.arange(5.0), np.array([1, 2, 3])).tolist() == []
    u[2:] = [1.0, 1.0 - 0.02, 0.99, 1.0]
    assert len(minor_loops.gaps(u, u, np.array([1, 2, 3]))) == (1.0 - u[3] >= 0.02)


@pytest.mark.parametrize(("inner", "count"), [(98, 1), (99, 0)])
def test_the_search_ends_after_two_hundred_turns(inner, count):
    levels = [0.3, 0.0, 1.0, *[0.5, 0.6] * inner, 0.4, 1.1]
    u = np.interp(np.arange(10 * len(levels) - 9), 10 * np.arange(len(levels)), levels)
    turns = turning_points(u, 0.0)
    y = np.arange(float(len(u)))
    closed = [g for g in minor_loops.gaps(u, y, turns) if g > 100]
    assert (len(closed) > 0) is bool(count)
    assert len(turns) == 2 * inner + 3


@pytest.mark.parametrize("rows", [1000, 60])
def test_the_width_is_the_rest_of_lines_over_fifty_parts(rows):
    rng = np.random.default_rng(SEED)
    u, y = rng.normal(size=rows), rng.normal(size=rows)
    order = np.argsort(u)
    parts = np.array_split(order, min(50, rows // 4))
    rest = [np.sum((y[p] - np.polyval(np.polyfit(u[p], y[p], 1), u[p])) ** 2) for p in parts]
    assert minor_loops.width(u, y) == pytest.approx(np.sqrt(np.sum(rest) / rows))


@pytest.fixture
def record(monkeypatch):
    """Examine 200 rows with y from 0 to 100, turning points every ten rows, and given gaps, noise and width."""

    def make(gap=0.0, loops=8, sigma=0.1, width=50.0, step=10, levels=None):
        u = np.zeros(200)
        turns = np.arange(1, 7) * step
        u[turns] = [0, 1, 0, 2, 0, 3] if levels is None else levels
        y = np.linspace(0, 100, 200)
        d = np.full(loops, np.sqrt(gap**2 + 2 * sigma**2))
        for name, value in (("gaps", d), ("noise", sigma), ("width", width), ("reversals", turns)):
            monkeypatch.setattr(minor_loops, name, lambda *given, value=value: value)
        return examine(SimpleNamespace(u=np.r_[9.0, u, 9.0], y=np.r_[500.0, y, -500.0], train=slice(1, 201)))

    return make


@pytest.mark.parametrize(
    ("given", "memory"),
    [
        ({"gap": 1.951}, OPEN_LOOPS),  # 20 samples a cycle: 3 * 260 / 400 = 1.95 % are the samples themselves
        ({"gap": 1.949}, UNKNOWN),
        ({"gap": 0.51, "step": 30}, OPEN_LOOPS),  # 60 a cycle: 0.22 %
        ({"gap": 0.49, "step": 30}, RETURN_POINT),
        ({"gap": 0.0}, RETURN_POINT),
        ({"gap": 0.0, "sigma": 0.28}, RETURN_POINT),  # 3 * 2 sigma^2 / 2 of eight loops: 0.485 %
        ({"gap": 0.0, "sigma": 0.30}, UNKNOWN),  # 0.52 %
        ({"gap": 0.0, "sigma": 0.30, "loops": 10}, RETURN_POINT),  # 0.49 %
        ({"gap": 0.6, "sigma": 0.4, "step": 30}, UNKNOWN),  # below its error of 0.69 %
        ({"gap": 0.7, "sigma": 0.4, "step": 30}, OPEN_LOOPS),
        ({"loops": 0}, UNKNOWN),
        ({"sigma": 1.0, "width": np.sqrt(0.709)}, NONE),  # 1 - 3 sqrt(2 / 200) and (0.1 %)^2
        ({"sigma": 1.0, "width": np.sqrt(0.711), "gap": 9.0}, OPEN_LOOPS),
        ({"sigma": 0.0, "width": 0.099}, NONE),
        ({"sigma": 0.0, "width": 0.101}, RETURN_POINT),
    ],
)
def test_the_class_of_the_memory(record, given, memory):
    seen = record(**given)
    assert seen.memory == memory
    assert seen.loops == given.get("loops", 8)
    assert seen.reversals == 6
    assert seen.samples_per_cycle == 2 * given.get("step", 10)
    if memory != NONE and seen.loops:
        assert seen.gap == pytest.approx(given.get("gap", 0.0), abs=1e-6)
    assert bool(seen.coarse) is (seen.samples_per_cycle < 50)


@pytest.mark.parametrize(("fast", "several"), [(2.01, True), (2.0, False), (1.99, False)])
def test_speeds_that_differ_twofold(record, fast, several):
    levels = [0, 1, 0, fast, 0, fast]
    assert record(levels=levels).several_speeds is several


def test_the_speeds_are_the_10th_and_90th_percentile_of_half_cycles(monkeypatch):
    rng = np.random.default_rng(SEED)
    for _ in range(60):
        turns = np.cumsum(rng.integers(5, 40, 8))
        u, y = np.zeros(400), np.linspace(0, 1, 400)
        u[turns] = np.cumsum((-1.0) ** np.arange(8) * rng.uniform(0.7, 1.2, 8) * np.diff(turns, prepend=0))
        speeds = np.sort(np.abs(np.diff(u[turns])) / np.diff(turns))  # seven: the percentiles lie at 0.6 and 5.4
        slow, swift = speeds[0] + 0.6 * (speeds[1] - speeds[0]), speeds[5] + 0.4 * (speeds[6] - speeds[5])
        for name, value in (("gaps", np.zeros(0)), ("noise", 0.0), ("width", 1.0), ("reversals", turns)):
            monkeypatch.setattr(minor_loops, name, lambda *given, value=value: value)
        seen = examine(SimpleNamespace(u=u, y=y, train=slice(0, 400)))
        assert seen.several_speeds is bool(swift > 2 * slow)
        assert seen.gap == 0.0


def test_a_record_without_reversals(monkeypatch):
    u = np.linspace(0, 1, 100)
    seen = examine(SimpleNamespace(u=u, y=np.sqrt(u), train=slice(0, 100)))
    assert (seen.reversals, seen.loops, seen.several_speeds) == (0, 0, False)
    assert seen.samples_per_cycle == 100
    assert len(seen.warnings) >= 1


@pytest.mark.parametrize(("samples", "words"), [(50.0, None), (49.4, "49 samples per cycle; at least 50 are needed")])
def test_fifty_samples_a_cycle(samples, words):
    found = minor_loops._coarse(samples)
    assert found == () if words is None else found[0].startswith(words)


@pytest.mark.parametrize(
    ("levels", "loops", "memory", "words"),
    [
        ([0, 1, 0], 5, UNKNOWN, ["one decaying"]),
        ([0, 1, 0, 1], 5, UNKNOWN, ["one decaying"]),
        ([0, 1, 0, 2], 5, UNKNOWN, []),
        ([0, 1, 0, 2], 0, UNKNOWN, ["closes no minor loop"]),
        ([0, 1, 0, 1.009], 5, UNKNOWN, ["one decaying"]),
        ([0, 1, 0, 1.012], 5, UNKNOWN, []),
        ([0, 3, 0, 3, 0.4, 3.0], 5, UNKNOWN, ["one decaying"]),
        ([0, 1, 0, 2], 5, NONE, ["thinner than 0.1 %"]),
        ([0, 1, 0, 1], 0, NONE, ["thinner than 0.1 %", "one decaying"]),
    ],
)
def test_excitation_that_is_not_informative(levels, loops, memory, words):
    found = minor_loops._warnings(np.array(levels, float), loops, memory)
    assert len(found) == len(words)
    assert all(word in line for word, line in zip(words, found, strict=True))
