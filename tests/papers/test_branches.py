"""Crossings of branches on curves whose crossings are known in closed form."""

import numpy as np
import pytest

from hystfmu.data import signals
from papers.statements.branches import area, crossings, least_slope


def test_two_branches_that_cross_once():
    """x goes 0, 1, 0, 1; h = x on the first branch, 1 on the second, x^2 + 1/4 - 1/8 on the third."""
    x = signals.ramps([0.0, 1.0, 0.0, 1.0], 1e-3)
    part = np.cumsum(np.abs(np.diff(x, prepend=0.0)))
    h = np.where(part <= 1, x, np.where(part <= 2, 1.0, x**2 + 3 / 16))
    y = np.where(part <= 1, 0.0, np.where(part <= 2, 5.0, 2 * x))
    found = crossings(x, h, y)
    assert (found.neighbours, found.others) == (1, 2)  # at x = sqrt(13)/4 with its neighbour, at 1/4 and 3/4
    assert found.difference == pytest.approx(5 - 2 * np.sqrt(13) / 4, abs=1e-3)


def test_a_closed_loop_has_no_crossing_and_its_area():
    t = 2 * np.pi * np.arange(400) / 400
    assert area(np.cos(t), np.sin(t)) == pytest.approx(np.pi / 4, rel=1e-3)
    assert area(np.cos(t), -np.sin(t)) == pytest.approx(-np.pi / 4, rel=1e-3)
    x = signals.ramps([0.0, 1.0, 0.0], 1e-2)
    assert least_slope(x, x**2, 0.1) == pytest.approx(0.01, abs=1e-9), "falling to 0: the slope of the last step"
    assert crossings(x, np.append(x[:101] ** 2, np.sqrt(x[101:])), x).neighbours == 0
