"""Properties of the controllers: frequency response, observer transfer, convergence of learning and sliding."""

import numpy as np
import pytest
import scipy.linalg
import scipy.signal

from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Node
from hystfmu.unit import Unit

H = 1e-4


def run(block: str, u: np.ndarray, values: dict[str, object], dims: dict[str, int] | None = None) -> np.ndarray:
    return Graph.single(Node(block, block, dims or {}, values)).run(u, H)


def test_lead_lag_is_scipys_bilinear_rule_and_keeps_the_phase() -> None:
    T_z, T_p, K = [2e-3, 1e-4], [3e-4, 2e-2], 0.7
    b, a = [K], [1.0]
    for z, p in zip(T_z, T_p, strict=True):
        b, a = np.polymul(b, [z, 1]), np.polymul(a, [p, 1])
    e = np.random.default_rng(0).normal(size=400)
    e[0] = 0
    bz, az = scipy.signal.bilinear(b, a, 1 / H)
    got = run("lead_lag", np.column_stack([e, 0 * e, 0 * e]), {"K": K, "T_z": T_z, "T_p": T_p}, {"n": 2})
    assert np.abs(got - scipy.signal.lfilter(bz, az, e)).max() < 1e-12
    w = 2 * np.pi * 500  # a twentieth of the sampling frequency
    continuous = np.polyval(b, 1j * w) / np.polyval(a, 1j * w)
    z = np.exp(1j * w * H)
    assert abs(np.angle(np.polyval(bz, z) / np.polyval(az, z) / continuous)) < np.deg2rad(1)


def plant(u: np.ndarray) -> np.ndarray:
    """500 Hz, damping 0.7, held input: y_k is what the commands before k led to."""
    w = 2 * np.pi * 500
    E = scipy.linalg.expm(H * np.array([[0, 1, 0], [-w * w, -1.4 * w, w * w], [0, 0, 0]]))
    x, y = np.zeros(2), [0.0]
    for v in u[:-1]:
        x = E[:2, :2] @ x + E[:2, 2] * v
        y.append(x[0])
    return np.array(y)


OBSERVER = {"f_n": 500.0, "zeta": 0.7, "f_o": 100.0}


@pytest.mark.parametrize("n", [1, 2, 4])
def test_observer_sees_nothing_in_the_nominal_plant(n: int) -> None:
    """The command passes unchanged, because no disturbance is found; y is late by n - 1 steps that it knows of."""
    u = np.random.default_rng(1).normal(size=500)
    y = np.concatenate([np.zeros(n - 1), plant(u)[: len(u) - n + 1]])
    out = run("disturbance_observer", np.column_stack([u, y]), OBSERVER, {"n": n})
    assert np.abs(out[:, 1]).max() < 1e-10


def test_observer_has_three_poles_where_it_says() -> None:
    """A step of d under its own compensation: the error (c_0 + c_1 k + c_2 k^2) z^k, z = exp(-2 pi f_o h), no more."""
    w, z = 2 * np.pi * 500, np.exp(-2 * np.pi * OBSERVER["f_o"] * H)
    E = scipy.linalg.expm(H * np.array([[0, 1, 0], [-w * w, -1.4 * w, w * w], [0, 0, 0]]))
    unit, x, error = Unit(Graph.single(Node("b", "disturbance_observer", {}, OBSERVER))), np.zeros(2), [1.0]
    unit.initialize(0.0, y=0.0, u_c=0.0)
    for k in range(400):
        x = E[:2, :2] @ x + E[:2, 2] * (unit.get("u") + 1.0)
        unit.set("y", x[0])
        unit.do_step(k * H, H)
        error.append(1.0 - unit.get("d_hat"))
    left = scipy.signal.lfilter([1, -3 * z, 3 * z**2, -(z**3)], [1], error)
    assert np.abs(left[4:]).max() < 1e-12 < np.abs(left[:3]).max()
    assert abs(error[-1]) < 1e-6


def test_observer_without_gain_or_with_a_step_too_long_is_refused() -> None:
    for values, words in (({"gain": 0.0}, "gain must not be 0"), ({"f_n": 1e9}, "the step is too long")):
        with pytest.raises(InputError, match=words):
            run("disturbance_observer", np.zeros((3, 2)), values)


def test_learning_of_a_static_plant_shrinks_the_error_by_one_minus_gain_g() -> None:
    n, g, gain = 50, 0.8, 0.9
    unit = Unit(Graph.single(Node("b", "iterative_learning", {"n": n}, {"gain": gain, "lead": 1})))
    unit.initialize(0.0, y_d=0.0, y=0.0, u_ff=0.0)
    r = np.sin(2 * np.pi * np.arange(8 * n) / n)
    e = [0.0]
    for k in range(1, len(r)):
        y = g * unit.get("u")  # of the command a step ago
        e.append(r[k] - y)
        unit.set("y_d", r[k]), unit.set("y", y)
        unit.do_step((k - 1) * H, H)
    periods = np.array(e).reshape(-1, n)
    for j in range(1, len(periods)):
        gap = periods[j, 1:] - (1 - gain * g) ** j * r[1:n]
        assert np.abs(gap).max() < 1e-14, j


def test_repetitive_error_shrinks_by_one_minus_gain_g_and_rests_while_inactive() -> None:
    """Plant y_k = g u_(k-1), so that T = g / z; with L = gain z and Q = 1, Q - L T = 1 - gain g."""
    n, g, gain, rest = 50, 0.8, 0.9, 3
    unit = Unit(Graph.single(Node("b", "repetitive", {"n": n, "n_q": 0}, {"q": [1.0], "l": [0.0, 0.0, gain]})))
    unit.initialize(0.0, y_d=0.0, y=0.0)
    r = np.sin(2 * np.pi * np.arange(8 * n) / n)
    e = [0.0]
    for k in range(1, len(r)):
        y = g * unit.get("r")
        e.append(r[k] - y)
        unit.set("y_d", r[k]), unit.set("y", y), unit.set("active", float(k // n != rest))
        unit.do_step((k - 1) * H, H)
    periods = np.array(e).reshape(-1, n)
    unlearnt = (r[1:] - g * r[:-1])[: n - 1]  # the error of the first period
    for j in range(1, len(periods)):
        learnt = j - (j > rest)  # steps of the memory that this period has seen
        gap = periods[j, 2:] - (1 - gain * g) ** learnt * unlearnt[1:]
        assert np.abs(gap).max() < 1e-13, j


@pytest.mark.parametrize("size", ["n_q", "n_l"])
def test_repetitive_filters_longer_than_a_period_are_refused(size: str) -> None:
    with pytest.raises(InputError, match="must be below n"):
        Unit(Graph.single(Node("b", "repetitive", {"n": 4, size: 4}, {})))


def slide(block: str, values: dict[str, float], h: float, lam: float) -> tuple[float, float]:
    """Largest |s| after 1 s, and total variation of the command, on y'' = u + 0.7 sin 5 t: (s, variation)."""
    unit = Unit(Graph.single(Node("b", block, {}, {"lam": lam, **values})))
    unit.initialize(0.0, y_d=0.0, y=0.0, u_ff=0.0)
    x, s, u = np.zeros(2), [], []
    for k in range(round(3 / h)):
        a = unit.get("u") + 0.7 * np.sin(5 * k * h)
        x = np.array([x[0] + h * x[1] + h * h / 2 * a, x[1] + h * a])
        unit.set("y", x[0])
        unit.do_step(k * h, h)
        s.append(unit.get("s")), u.append(unit.get("u"))
    late = len(s) // 3
    return float(np.abs(s[late:]).max()), float(np.abs(np.diff(u[late:])).sum())


def test_super_twisting_slides_closer_and_without_chattering() -> None:
    """|d'| <= L = 3.5; gains 1.5 sqrt(L) and 1.1 L of Levant (k_2 counts half).  The relay needs rho > 0.7."""
    L = 3.5
    twisting = {"k_1": 1.5 * L**0.5, "k_2": 2 * 1.1 * L, "epsilon": 1e-9}
    relay = {"eta": 0.0, "rho": 1.0, "epsilon": 1e-9}
    fine, coarse = slide("super_twisting", twisting, 5e-4, 2.0), slide("super_twisting", twisting, 2e-3, 2.0)
    plain = slide("sliding_mode", relay, 2e-3, 2.0)
    print(fine, coarse, plain)
    assert coarse[0] < 0.5 * plain[0]
    assert coarse[1] < 0.1 * plain[1]
    assert fine[0] < coarse[0] / 4
