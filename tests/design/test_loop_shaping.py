"""Robust controllers of shaped plants against closed forms and against the norm that they are to keep."""

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.design import loop_shaping
from hystfmu.design.linear import python_control

control = python_control()
ONE = control.tf([1.0], [1.0])
WEIGHT = control.tf([300.0, 3e5], [1.0, 0.0])
PLANT = control.tf([9.87e6], [1.0, 4398.0, 9.87e6]) * control.tf(*control.pade(1.5e-4, 2))


def margin(shaped: object, K: object, points: np.ndarray) -> float:
    """Return 1 / norm of [K; 1] (1 + G K)^-1 [1 G], negative feedback, both systems with one input and output."""
    G, C = np.asarray(shaped(points)), np.asarray(K(points))  # type: ignore[operator]
    return float((np.abs(1 + G * C) / np.sqrt((1 + np.abs(G) ** 2) * (1 + np.abs(C) ** 2))).min())


@pytest.mark.parametrize(("pole", "b_opt"), [(0.0, 1 / np.sqrt(2)), (1.0, None), (-3.0, None)])
def test_first_order_plants_have_the_closed_form(pole: float, b_opt: float | None) -> None:
    """G = 1 / (s + p): X = Z = -p + sqrt(p^2 + 1), so that gamma^2 = 1 + X^2; an integrator reaches 1 / sqrt 2."""
    X = -pole + np.sqrt(pole**2 + 1)
    found = loop_shaping(control.tf([1.0], [1.0, pole]), ONE)
    assert found.b_opt == pytest.approx(1 / np.sqrt(1 + X**2), rel=1e-9)
    assert b_opt is None or found.b_opt == pytest.approx(b_opt, rel=1e-9)


def test_the_margin_is_reached_and_hardly_more() -> None:
    found = loop_shaping(PLANT, WEIGHT)
    points = 1j * np.geomspace(1, 1e6, 4000)
    reached = margin(PLANT * WEIGHT, found.robust, points)
    assert found.b * (1 - 1e-6) <= reached <= found.b_opt * (1 + 1e-6)
    poles = control.feedback(PLANT * control.tf(found.controller), 1).poles()
    assert poles.real.max() < 1e-3  # rounding of poles that cancel
    near = loop_shaping(PLANT, WEIGHT, ratio=1.001)
    assert margin(PLANT * WEIGHT, near.robust, points) == pytest.approx(near.b_opt, rel=0.01)


def test_a_sampled_plant_has_its_own_margin_and_keeps_it() -> None:
    h = 1e-4
    G = control.sample_system(control.tf([9.87e6], [1.0, 4398.0, 9.87e6]), h) * control.tf([1.0], [1.0, 0.0], h)
    W = control.tf([300.0, -270.0], [1.0, -1.0], h) * 1e-3
    found = loop_shaping(G, W)
    points = np.exp(1j * np.pi * np.geomspace(1e-5, 1, 4000))
    reached = margin(G * W, found.robust, points)
    assert found.b * (1 - 1e-6) <= reached <= found.b_opt * (1 + 1e-6)
    assert np.abs(control.feedback(control.ss(G) * found.controller, 1).poles()).max() < 1


def test_a_ratio_of_one_is_refused() -> None:
    with pytest.raises(InputError, match="ratio"):
        loop_shaping(PLANT, WEIGHT, ratio=1.0)
