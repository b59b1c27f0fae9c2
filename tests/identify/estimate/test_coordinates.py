"""Coordinates of a search by numbers: default bounds, the values at a point, and back."""

from types import SimpleNamespace

import numpy as np
import pytest

from hystfmu import Dataset, Graph, Input, Node, Output
from hystfmu.identify.estimate import coordinates
from hystfmu.identify.estimate.free import Free

U = np.linspace(-1.0, 2.0, 101)
DATA = Dataset.from_signal(U, U, 0.01).with_train((0, 100))
GRAPH = Graph(
    [Node("g", "scaling", {"n": 1}, {"gain": 2.0}), Node("b", "play_bank", {"n": 1}), Node("a", "play_bank", {"n": 1})],
    [("g.y", "b.u")],
    [Input("u", ("a.u", "g.u"))],
    [Output("y", "b.z"), Output("v", "a.z")],
)


def free(start, lo=-np.inf, hi=np.inf, unit="1", follows="", node="x", text="", **given):
    row = SimpleNamespace(lo=lo, hi=hi, unit=unit, follows=follows, text=text)
    start = np.atleast_1d(np.asarray(start, dtype=float))
    return Free("x", node, "p", tuple(range(len(start))), row, start, len(start), **given)


@pytest.mark.parametrize(("of", "bounds"), [
    (free(5.0, unit="Hz"), (1.0, 50.0)),
    (free(0.5, unit="Hz"), (0.5, 50.0)),  # the start is inside
    (free(0.5, unit="s"), (1e-3, 10.0)),
    (free(0.5, -2.0, 3.0), (-2.0, 3.0)),
    (free(4.0, -2.0, 1e5), (-2.0, 40.0)),
    (free(0.5, follows="u", node="a"), (-3.97, 4.94)),
    (free(0.5, 0.0, follows="u", node="a"), (0.0, 2.97)),
    (free(0.5, follows="u", node="b"), (-7.94, 9.88)),
    (free(0.5, follows="u"), (-3.0, 3.0)),  # nothing drives it: a range of 2
    (free([2.0, 4.0], 0.0), (2e-3, 4e3)),
    (free([2.0, 4.0], 0.0, rising=True), (0.0, 40.0)),
    (free([-2.0, 4.0]), (-40.0, 40.0)),
    (free([-0.5, 0.1]), (-10.0, 10.0)),
    (free(4.0, 0.0, lower=1.0), (1.0, 4e3)),
    (free(4.0, 0.0, upper=9.0), (4e-3, 9.0)),
])  # fmt: skip
def test_the_default_bounds_of_a_parameter(of, bounds):
    assert coordinates.default_bounds(of, GRAPH, DATA) == pytest.approx(bounds)


@pytest.mark.parametrize(("of", "log"), [
    (free(1.0, 0.0), True), (free(0.0, 0.0), False), (free(1.0, -1.0), False), (free(1.0, 0.0, 9.0), False),
    (free(1.0, 0.0, 1e5), True), (free(1.0, 0.0, 99999.0), False), (free(1.0, 0.0, follows="u"), False),
    (free(1.0, 0.0, lower=0.0), False), (free(1.0, 0.0, lower=0.5), True), (free(1.0, 0.0, scale="linear"), False),
    (free(1.0, -1.0, 2.0, scale="log"), True), (free([1.0, 2.0], 0.0, rising=True), False),
])  # fmt: skip
def test_of_which_parameters_the_logarithm_is_searched(of, log):
    assert coordinates.is_log(of) is log


def test_the_values_at_a_point_and_the_point_of_values():
    frees = [free([0.2, 0.3, 0.5], sum=1.0), free([0.5, 1.0, 4.0], rising=True), free([2.0, 8.0], 0.0), free(-3.0)]
    frees = [Free(f"x{k}", "n", f"p{k}", f.elements, f.row, f.start, f.whole, sum=f.sum, rising=f.rising)
             for k, f in enumerate(frees)]  # fmt: skip
    whole = {f.place: f.start.copy() for f in frees}
    whole["n.p3"] = np.array([-3.0, 7.0])  # one element is not free
    found, start = coordinates.made_coordinates(frees, [(0, 1), (0.0, 6.0), (1.0, 10.0), (-5.0, 5.0)], whole)
    first = np.log([0.4, 0.6])
    assert start == pytest.approx([*first, 0.5, 0.5, 3.0, np.log(2), np.log(8), -3.0])
    assert found.lo == pytest.approx([*(first - 10), 0, 0, 0, 0, 0, -5])
    assert found.hi == pytest.approx([*(first + 10), 6, 6, 6, np.log(10), np.log(10), 5])
    assert found.scale == pytest.approx([0.3, 0.3, 0.2, 0.2, 0.2, 0.3, 0.3, 1.0])
    for name, values in found.values(start).items():
        assert values == pytest.approx(whole[name])
    moved = found.values(start + np.array([1.0, 0, 0, 0, 9, 1.0, 0, 1.0]))
    shares = np.array([0.4 * np.e, 0.6, 1.0])
    assert moved["n.p0"] == pytest.approx(shares / shares.sum())
    assert moved["n.p1"] == pytest.approx([0.5, 1.0, 6.0])  # not above its bound
    assert moved["n.p2"] == pytest.approx([2 * np.e, 8.0])
    assert moved["n.p3"] == pytest.approx([-2.0, 7.0])
