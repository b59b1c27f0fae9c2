"""Derivatives of inputs (FMI 2.0): each element has its own, a call sets all or none, and one step uses them up."""

from __future__ import annotations

import ctypes as C
import math
from collections.abc import Callable

import numpy as np
import pytest
from fmu_master import ERROR, OK, H, Master

from hystfmu.graph import Graph, Input, Node, Output

Make = Callable[..., Master]
N = 3


@pytest.fixture
def fmi() -> int:
    return 2


def ways() -> Graph:
    """Return a graph with two scalar inputs and one of three elements, each of which is an output."""
    nodes = [Node(n, "sum", {"n": 1}, {"k": [1.0]}) for n in "ab"] + [Node("s", "scaling", {"n": N})]
    inputs = [Input("ua", ("a.u[1]",)), Input("us", ("s.u",)), Input("ub", ("b.u[1]",))]
    outputs = [Output("ya", "a.y"), Output("yb", "b.y"), Output("ys", "s.y")]
    return Graph(nodes, [], inputs, outputs).with_step(H)


def elements(m: Master) -> list[int]:
    """Return the references of all elements of all inputs."""
    return [m.ports[n].reference + k for n in ("ua", "us", "ub") for k in range(m.ports[n].size)]


def slopes(m: Master, *rows: tuple[int, int, float]) -> int:
    """Set derivatives by (reference, order, value) in one call."""
    refs, orders, values = zip(*rows, strict=True)
    n = len(rows)
    arrays = (C.c_uint * n)(*refs), C.c_size_t(n), (C.c_int * n)(*orders), (C.c_double * n)(*values)
    return m.call("SetRealInputDerivatives", *arrays)


def read(m: Master) -> list[float]:
    """Return the values of all elements of all inputs."""
    return [x for n in ("ua", "us", "ub") for x in np.atleast_1d(m.get(n))]


def begun(make: Make) -> Master:
    m = make(ways())
    m.initialize()
    assert m.set("us", 1.0, 2.0, 3.0) == OK
    return m


def test_every_order_of_every_element_is_its_own(make: Make) -> None:
    """u + s1 h + s2 h^2 / 2 + s3 h^3 / 6 at the end of a step of h; a step later all stay where they are."""
    h = 0.5
    seed = int(np.random.default_rng().integers(2**32))
    print("seed", seed)
    given = np.random.default_rng(seed).uniform(-1, 1, (N + 2, 3))
    m = begun(make)
    start = np.array(read(m))
    rows = [(r, k + 1, float(given[j, k])) for j, r in enumerate(elements(m)) for k in range(3)]
    assert slopes(m, *rows) == OK
    content = m.memory()
    assert slopes(m, *rows[::-1]) == OK
    assert m.memory() == content, "in any order of a call, and at no other place"
    for t in (0.0, h, 2 * h):
        assert m.step(t, h) == OK
        want = start + given @ [h, h**2 / 2, h**3 / 6]
        np.testing.assert_allclose(read(m), want, rtol=1e-14, atol=1e-15)


def test_each_derivative_is_part_of_the_state_of_its_element(make: Make) -> None:
    m = begun(make)
    plain = m.memory()
    seen = set()
    for reference in elements(m):
        for order in (1, 2, 3):
            state = m.save()
            assert slopes(m, (reference, order, 0.75)) == OK
            content = m.memory()
            differs = [k // 8 for k in range(len(plain)) if plain[k] != content[k]]
            seen.add(max(differs))
            again, copy = m.deserialize(content)
            assert again == OK
            assert m.restore(copy) == OK
            before = read(m)
            assert m.step(0.0) == OK
            moved = np.subtract(read(m), before)
            place = elements(m).index(reference)
            assert moved[place] == pytest.approx(0.75 * H**order / math.factorial(order), rel=1e-6)
            assert np.count_nonzero(moved) == 1
            assert m.restore(state) == OK
            assert m.memory() == plain
            m.forget(state), m.forget(copy)
    assert len(seen) == 3 * (N + 2), "a place for each"


def test_a_zero_after_another_derivative_keeps_the_other(make: Make) -> None:
    m = begun(make)
    first, second = elements(m)[:2]
    assert slopes(m, (first, 1, 8.0), (second, 1, 0.0)) == OK
    assert slopes(m, (second, 2, 0.0)) == OK
    before = read(m)
    assert m.step(0.0) == OK
    assert m.get("ua") == before[0] + 8.0 * H
    assert m.get("ya") == before[0] + 8.0 * H
    assert slopes(m, (first, 1, 8.0)) == OK
    assert slopes(m, (first, 1, 0.0)) == OK
    before = read(m)
    assert m.step(H) == OK
    assert read(m) == before, "taken back"


@pytest.mark.parametrize("value", [4.0, -4.0])
def test_one_step_uses_derivatives_up(make: Make, value: float) -> None:
    """The state after the step is that of an importer which set the same value at the end of the step."""
    m, plain = begun(make), begun(make)
    for reference in elements(m):
        assert slopes(m, (reference, 1, value)) == OK
    assert m.memory() != plain.memory()
    assert m.step(0.0, 0.5) == OK
    for name in ("ua", "us", "ub"):
        assert plain.set(name, *map(float, np.atleast_1d(m.get(name)))) == OK
    assert plain.step(0.0, 0.5) == OK
    for name in ("ya", "ys", "yb"):
        assert m.get(name) == plain.get(name)
    for each in (m, plain):
        assert each.step(0.5, 0.5) == OK
    assert m.memory() == plain.memory()


def test_a_call_sets_all_derivatives_or_none(make: Make) -> None:
    m = begun(make)
    before = m.memory()
    good = (elements(m)[0], 1, 1.0)
    y = m.ports["ya"].reference
    for bad, said in [
        ((y, 1, 1.0), "'ya' is not an input."),
        ((10**6, 1, 1.0), "no variable has the value reference 1000000."),
        ((good[0], 4, 1.0), "the order must be in 1..3. Got 4 instead."),
        ((good[0], 0, 1.0), "the order must be in 1..3. Got 0 instead."),
        *(((good[0], 1, x), "a derivative of 'ua' is not finite.") for x in (math.inf, math.nan)),
    ]:
        for rows in [(good, bad), (bad, good), (bad,)]:
            assert slopes(m, *rows) == ERROR
            assert m.messages.pop()[2] == f"fmi2SetRealInputDerivatives: {said}"
            assert m.memory() == before


def test_a_reset_forgets_derivatives(make: Make) -> None:
    m = begun(make)
    assert slopes(m, *[(r, 1, 1.0) for r in elements(m)]) == OK
    assert m.call("Reset") == OK
    m.initialize()
    before = read(m)
    assert m.step(0.0) == OK
    assert read(m) == before


def test_the_element_that_leaves_its_range_stops_all(make: Make) -> None:
    """Any element: none has moved, and a smaller derivative makes the same step."""
    for place, reference in enumerate(elements(begun(make))):
        m = begun(make)
        before, others = read(m), [r for r in elements(m) if r != reference]
        assert slopes(m, (reference, 1, 1e308), *[(r, 1, 1.0) for r in others]) == OK
        assert m.step(0.0, 10.0) == ERROR
        name = ["ua", "us", "us", "us", "ub"][place]
        lead = f"The derivatives of '{name}' lead to inf at the end of the step, out of its range."
        assert m.messages.pop()[2] == lead
        assert read(m) == before
        assert slopes(m, (reference, 1, 1.0)) == OK
        assert m.step(0.0, 10.0) == OK
        assert read(m) == [x + 10.0 for x in before]
