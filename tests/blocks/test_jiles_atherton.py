"""The Jiles-Atherton operator against an integration of its susceptibility, its closed forms and its symmetries."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from whole_history import SIGNALS, every_signal

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.graph.blocks import JilesAtherton

Array = NDArray[np.float64]

LAWS = {
    "soft": {"Ms": 1.0, "a": 0.3, "k": 0.05, "c": 0.3, "alpha": 0.1},
    "hard": {"Ms": 1.0, "a": 0.3, "k": 0.4, "c": 0.05, "alpha": 0.8},
    "no mean field": {"Ms": 2.0, "a": 0.5, "k": 0.2, "c": 0.2, "alpha": 0.0},
    "demagnetising field": {"Ms": 1.5, "a": 0.4, "k": 0.3, "c": 0.1, "alpha": -0.5},
    "nothing reversible": {"Ms": 1.0, "a": 0.2, "k": 0.2, "c": 0.0, "alpha": 0.2},
}
every_law = pytest.mark.parametrize("law", LAWS)


def langevin(x: float) -> tuple[float, float]:
    """L(x) and its slope."""
    if abs(x) < 1e-2:
        return x / 3 - x**3 / 45 + 2 * x**5 / 945, 1 / 3 - x**2 / 15 + 2 * x**4 / 189
    return 1 / np.tanh(x) - 1 / x, 1 / x**2 - 1 / np.sinh(x) ** 2


def integrated(u: Array, Ms: float, a: float, k: float, c: float, alpha: float) -> Array:
    """dM/dH = chi/(1 - alpha chi), chi = max(0, s (M_an - M))/k + c dM_an/dH_e, from H = M = 0, cut where M = M_an."""
    m, out = 0.0, []
    for first, last in pairwise(np.concatenate([[0.0], u])):
        s = np.sign(last - first)

        def rate(h: float, M: Array, s: float = s) -> list[float]:
            L, slope = langevin((h + alpha * M[0]) / a)
            chi = max(0.0, s * (Ms * L - M[0])) / k + c * Ms / a * slope
            return [chi / (1 - alpha * chi)]

        def free(h: float, M: Array) -> float:
            return float(Ms * langevin((h + alpha * M[0]) / a)[0] - M[0])

        free.terminal = True  # type: ignore[attr-defined]
        at, pinned = first, s * free(first, np.array([m])) < -1e-9
        while at != last:
            r = solve_ivp(rate, (at, last), [m], "DOP853", rtol=1e-12, atol=1e-14, events=free if pinned else None)
            at, m, pinned = r.t[-1], float(r.y[0, -1]), False
        out.append(m)
    return np.array(out)


@pytest.mark.some(0.5)
@every_law
def test_it_is_its_differential_equation(law: str) -> None:
    u = 1.5 * SIGNALS["white"][:50]
    want = integrated(u, **LAWS[law])
    assert np.abs(JilesAtherton(**LAWS[law])(u) - want).max() <= 1e-9 * np.ptp(want)


@every_law
def test_the_error_falls_with_the_steps(law: str) -> None:
    """Order 6: steps of a half have at most a twentieth of the error, down to the error of the finest."""
    u = 1.5 * SIGNALS["white"]
    want = JilesAtherton(**LAWS[law], steps=16)(u)
    error = [np.abs(JilesAtherton(**LAWS[law], steps=n)(u) - want).max() for n in (1, 2, 4)]
    assert error[1] <= error[0] / 15
    assert error[2] <= error[1] / 15
    assert error[2] <= 1e-9


@every_law
@every_signal
def test_a_path_may_be_divided(law: str, signal: str) -> None:
    u = SIGNALS[signal]
    fine = np.interp(np.arange(8 * (len(u) - 1) + 1) / 8, np.arange(len(u)), u)
    block = JilesAtherton(**LAWS[law])
    assert np.abs(block(fine)[::8] - block(u)).max() <= 1e-9
    assert np.array_equal(block.graph.run(u, 1e-4), block(u))


@every_law
def test_a_jump_through_saturation_is_many_small_steps(law: str) -> None:
    levels = np.array([0.0, 40.0, -40.0, 0.1, 3e3, -2.9e3, 0.2, -1e5, 0.0])
    block = JilesAtherton(**LAWS[law])
    way = [np.linspace(a, b, 2001)[1:] for a, b in pairwise(levels)]
    assert np.abs(block(np.concatenate(way))[1999::2000] - block(levels)[1:]).max() <= 1e-8 * LAWS[law]["Ms"]
    assert np.abs(block([0.0, 1e300, -1e300])).max() <= LAWS[law]["Ms"]


@every_law
def test_the_susceptibility_is_never_negative(law: str) -> None:
    """Behind a reversal above all, where the plain equation turns the loop inside out."""
    u = np.interp(np.arange(4000) / 40, np.arange(101), np.random.default_rng(2).uniform(-1.5, 1.5, 101))
    y = JilesAtherton(**LAWS[law])(u)
    assert (np.diff(y) * np.diff(u) >= -1e-15).all()
    assert np.abs(y).max() < LAWS[law]["Ms"]


@every_law
def test_slopes_at_the_demagnetised_state_and_behind_a_reversal(law: str) -> None:
    """c Ms/(3 a) of the effective field at first; the reversible part alone behind a reversal in saturation."""
    v = LAWS[law]
    chi = v["c"] * v["Ms"] / (3 * v["a"])
    e = 1e-7
    assert JilesAtherton(**v)([0.0, e])[-1] / e == pytest.approx(chi / (1 - v["alpha"] * chi), abs=1e-5)
    top = JilesAtherton(**v)([0.0, 1.0, 1.0 - e])
    chi = v["c"] * v["Ms"] / v["a"] * langevin((1.0 + v["alpha"] * top[1]) / v["a"])[1]
    assert (top[1] - top[2]) / e == pytest.approx(chi / (1 - v["alpha"] * chi), abs=1e-5)


@every_law
def test_symmetry_and_units(law: str) -> None:
    """An odd operator; other units of field and magnetisation scale it."""
    v, u = LAWS[law], 1.5 * SIGNALS["white"]
    y = JilesAtherton(**v)(u)
    assert np.abs(JilesAtherton(**v)(-u) + y).max() <= 1e-15 * v["Ms"]
    other = {"Ms": 1e6 * v["Ms"], "a": 1e3 * v["a"], "k": 1e3 * v["k"], "c": v["c"], "alpha": 1e-3 * v["alpha"]}
    assert np.abs(JilesAtherton(**other)(1e3 * u) / 1e6 - y).max() <= 1e-13 * v["Ms"]


@every_law
def test_the_implicit_inverse_gives_the_field_back(law: str) -> None:
    """The field of a wanted magnetisation: the inverse tries the operator itself, with the same steps."""
    u = SIGNALS["white"][:100]
    model = hy.Model.of_block(JilesAtherton(**LAWS[law]))
    y = model.predict(u)
    inverse = model.inverse("implicit", lo=-5.0, hi=5.0)
    assert np.abs(model.predict(inverse.predict(y)) - y).max() <= 1e-14 * LAWS[law]["Ms"]
    if LAWS[law]["c"] > 0:  # otherwise a range of fields has the same magnetisation
        assert np.abs(inverse.predict(y) - u).max() <= 1e-11


def test_what_no_material_does_is_refused() -> None:
    with pytest.raises(InputError, match="alpha Ms must be less than 3 a, otherwise the anhysteretic curve jumps"):
        JilesAtherton(Ms=1.0, a=0.3, alpha=0.9)([0.0])
    with pytest.raises(InputError, match=r"m0\| must be at most Ms, and its distance "):
        JilesAtherton(m0=0.6)([0.0])
    assert JilesAtherton(m0=0.2)([0.0])[0] == pytest.approx(0.9 * 0.2 + 0.1 * langevin(0.05 * 0.18 / 0.3)[0], abs=1e-4)
