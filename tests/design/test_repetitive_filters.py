"""Filters of repetitive control against closed forms, and against the block in a simulated loop."""

from __future__ import annotations

import numpy as np
import pytest

from hystfmu import Unit
from hystfmu.base.errors import InputError
from hystfmu.design import repetitive_filters
from hystfmu.design.linear import python_control
from hystfmu.graph import Graph, Node

H, G = 1e-3, 0.8


def loop_of(gain: float, steps: int = 2) -> object:
    """Open loop L = T / (1 - T) of T = gain z^-steps."""
    a = np.zeros(steps + 1)
    a[0], a[-1] = 1.0, -gain
    return python_control().tf([gain], a, H)


def test_filter_of_a_delay_undoes_it_and_leaves_one_minus_gain() -> None:
    found = repetitive_filters([loop_of(G)], 150.0, gain=0.4, n_q=9, n_l=40)
    both = np.concatenate([found.q[:0:-1], found.q])
    assert both.sum() == pytest.approx(1.0, abs=1e-12)
    expected = np.zeros(81)
    expected[40 + 2 - 9 : 40 + 2 + 10] = 0.4 / G * both  # two steps ahead
    assert found.l == pytest.approx(expected, abs=1e-12)
    w = np.linspace(0.0, np.pi, 20001)
    Q = found.q[0] + 2 * np.cos(np.outer(w, np.arange(1, 10))) @ found.q[1:]
    assert found.contraction == pytest.approx([0.6 * np.abs(Q).max()], rel=1e-4)


def test_several_loops_share_the_filter_of_least_squares() -> None:
    """T_i = g_i z^-2: L = gain Q z^2 sum g / sum g^2, and 1 - gain g_i sum g / sum g^2 is left of Q."""
    g = np.array([0.5, 1.0])
    found = repetitive_filters([loop_of(v) for v in g], 150.0, gain=0.4)
    share = 1 - 0.4 * g * g.sum() / (g @ g)
    assert found.contraction == pytest.approx(share * found.contraction[0] / share[0], rel=1e-9)
    assert found.contraction[0] == pytest.approx(share[0], rel=0.02)  # max abs(Q) is 1 but for its ripple


def test_error_ratio_is_that_of_the_block_in_the_loop() -> None:
    n, f = 25, 31.0
    found = repetitive_filters([loop_of(G)], 150.0, gain=0.4, n_q=4, n_l=12)
    unit = Unit(Graph.single(Node("b", "repetitive", {"n": n, "n_q": 4, "n_l": 12}, {"q": found.q, "l": found.l})))
    unit.initialize(0.0, y_d=0.0, y=0.0, active=1.0)
    r, given, error = np.sin(2 * np.pi * f * H * np.arange(4000)), [0.0, 0.0], []
    for k, r_k in enumerate(r):
        y = G * given[-2]
        error.append(r_k - y)
        unit.set("y_d", r_k), unit.set("y", y)
        unit.do_step(k * H, H)
        given.append(unit.get("r"))
    without = np.abs(1 - G * np.exp(-2j * np.pi * f * H * 2))
    amplitude = np.sqrt(2 * np.mean(np.square(error[2000:])))  # a whole number of cycles
    assert found.error_ratio(loop_of(G), np.array([2 * np.pi * f]), n)[0] == pytest.approx(
        amplitude / without, rel=1e-6
    )


@pytest.mark.parametrize(("loops", "cutoff", "words"), [([], 100.0, "at least one"), ([loop_of(G)], 600.0, "cutoff")])
def test_no_loop_and_a_cutoff_too_high_are_refused(loops: list[object], cutoff: float, words: str) -> None:
    with pytest.raises(InputError, match=words):
        repetitive_filters(loops, cutoff)
