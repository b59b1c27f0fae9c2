"""The sector of slopes of units in series against slopes known by hand."""

from __future__ import annotations

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.design import sector
from hystfmu.graph import Graph, Input, Node, Output

H = 1e-3
W0, R, W = 0.3, 0.1, 0.7


def play(gain: float = 1.0) -> Graph:
    """w0 u + w p_r[u] by slopes w0 inside of the play and w0 + w outside, before dynamics with static gain `gain`."""
    nodes = [
        Node("plays", "prandtl_ishlinskii", {"n": 1}, {"w0": W0, "r": [R], "w": [W]}),
        Node("g0", "transfer_function", {"na": 2}, {"b": [gain * 1e6], "a": [1.0, 1e3, 1e6]}),
    ]
    return Graph(nodes, [("plays.y", "g0.u")], [Input("u", ("plays.u",))], [Output("y", "g0.y")])


def test_slopes_of_a_play_are_those_inside_and_outside() -> None:
    path = np.sin(np.linspace(0.0, 9.0, 4001))
    assert sector(path, play(1.5), h=H) == pytest.approx((1.5 * W0, 1.5 * (W0 + W)), rel=1e-9)


def test_exact_inverse_leaves_the_gain_of_the_dynamics_and_a_wrong_one_the_ratio() -> None:
    path = 0.8 * np.sin(np.linspace(0.0, 9.0, 4001))
    exact = {"w0": W0, "r": [R], "w": [W]}
    inverse = Graph.single(Node("inverse", "prandtl_ishlinskii_inverse", {"n": 1}, exact))
    assert sector(path, inverse, play(1.2), h=H) == pytest.approx((1.2, 1.2), rel=1e-6)
    twice = Graph.single(Node("inverse", "prandtl_ishlinskii_inverse", {"n": 1}, exact | {"w0": 2 * W0, "w": [2 * W]}))
    assert sector(path, twice, play(), h=H) == pytest.approx((0.5, 0.5), rel=1e-6)


def test_a_path_at_rest_is_refused() -> None:
    with pytest.raises(InputError, match="must move"):
        sector(np.ones(5), play(), h=H)
