"""The Coleman-Hodgdon operator against its differential equation, the Bouc-Wen operator, and its loops."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from whole_history import SIGNALS, every_signal

import hystfmu as hy
from hystfmu.graph.blocks import BoucWen, ColemanHodgdon

Array = NDArray[np.float64]

LAWS = {
    "counter-clockwise": {"alpha": 2.0, "b": 1.0, "k": 0.6}, "clockwise": {"alpha": 0.7, "b": 0.2, "k": 1.5},
    "no line": {"alpha": 3.0, "b": 0.0, "k": 1.0}, "falling first": {"alpha": 1.5, "b": 1.0, "k": -0.4},
    "nearly straight": {"alpha": 1e-9, "b": 3.0, "k": 1.0}, "nearly a relay": {"alpha": 1e4, "b": 0.5, "k": 2.0},
}  # fmt: skip
every_law = pytest.mark.parametrize("law", LAWS)


def integrated(u: Array, y: float, alpha: float, b: float, k: float) -> Array:
    """y' = alpha |u'| (b u - y) + k u' over every monotone piece by Radau's or the eighth-order rule."""
    out = [y]
    for first, last in pairwise(u):
        s = np.sign(last - first)

        def rate(x: float, y: Array, s: float = s) -> Array:
            return s * alpha * (b * x - y) + k

        if s:
            method = "Radau" if alpha > 100 else "DOP853"
            y = float(solve_ivp(rate, (first, last), [y], method, rtol=1e-11, atol=1e-13).y[0, -1])
        out.append(y)
    return np.array(out)


@pytest.mark.turn("blocks and other integrators")
@pytest.mark.some(1)
@every_law
def test_it_is_its_differential_equation(law: str) -> None:
    u = 1.5 * SIGNALS["white"][:60]
    y = ColemanHodgdon(**LAWS[law], y0=0.3, u0=u[0])(u)
    want = integrated(u, 0.3, **LAWS[law])
    assert np.abs(y - want).max() <= 1e-9 * np.abs(want).max()


@every_law
@every_signal
def test_a_path_may_be_divided(law: str, signal: str) -> None:
    """The exponentials of the parts of a way multiply, and time does not matter."""
    u = SIGNALS[signal]
    fine = np.interp(np.arange(8 * (len(u) - 1) + 1) / 8, np.arange(len(u)), u)
    block = ColemanHodgdon(**LAWS[law], y0=-0.2, u0=0.1)
    y = block(u)
    assert np.abs(block(fine)[::8] - y).max() <= 1e-14 * np.abs(y).max()
    assert np.array_equal(block.graph.run(u, 1e-4), y)


@every_signal
@pytest.mark.parametrize("b", [0.0, 0.3, 0.9])
def test_where_b_is_below_k_it_is_a_bouc_wen_operator(signal: str, b: float) -> None:
    """n = 1, gamma = 0: z' = u' - alpha |u'| z, y = k (b/k u + (1 - b/k) z)."""
    u = SIGNALS[signal]
    z0 = 0.2
    want = BoucWen(A=1.0, beta=1.7, gamma=0.0, n=1.0, alpha=b / 1.2, k=1.2, z0=z0, u0=0.1)(u)[:, 0]
    y = ColemanHodgdon(alpha=1.7, b=b, k=1.2, y0=b * 0.1 + (1.2 - b) * z0, u0=0.1)(u)
    assert np.abs(y - want).max() <= 1e-14 * np.abs(want).max()


def test_the_large_loop_has_the_width_of_the_closed_form() -> None:
    """The steady loop between -U and U: w at its end is (k - b)/alpha tanh(alpha U), by odd symmetry."""
    alpha, b, k, top = 0.8, 1.3, 0.9, 1.7
    u = np.tile([top, 0.0, -top, 0.0], 40)
    y = ColemanHodgdon(alpha=alpha, b=b, k=k)(u)[-4:]
    end = (k - b) / alpha * np.tanh(alpha * top)
    middle = (k - b) / alpha * (np.tanh(alpha * top) * np.exp(-alpha * top) - (1 - np.exp(-alpha * top)))
    assert y == pytest.approx([b * top + end, middle, -b * top - end, -middle], abs=1e-13)
    assert middle > 0  # counter-clockwise: the falling branch is above the rising one


@every_signal
def test_the_implicit_inverse_gives_the_input_back(signal: str) -> None:
    """0 < b < 2 k: y increases with u from every state within the loop."""
    u = SIGNALS[signal]
    model = hy.Model.of_block(ColemanHodgdon(alpha=2.0, b=1.0, k=0.6))
    inverse = model.inverse("implicit", lo=-4.0, hi=4.0)
    assert np.abs(inverse.predict(model.predict(u)) - u).max() <= 1e-13
    assert np.abs(model.predict(inverse.predict(0.8 * u)) - 0.8 * u).max() <= 1e-14


def test_long_steps_and_large_numbers_end_on_the_line() -> None:
    block = ColemanHodgdon(alpha=2.0, b=1.0, k=0.5)
    assert block([0.0, 1e3, -1e3]) == pytest.approx([0.0, 1e3 - 0.25, -1e3 + 0.25], rel=1e-15)
    assert np.isfinite(block([0.0, 1e300, -1e300])).all()
