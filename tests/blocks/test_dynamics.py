"""Transfer functions and delays against scipy.signal, 60 digits of mpmath, and closed forms."""

from typing import Any

import mpmath as mp
import numpy as np
import pytest
import scipy.signal
import scipy.stats
from numpy.typing import NDArray

from hystfmu import InputError, Unit, blocks

Array = NDArray[np.float64]


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


# ---- transfer_function ----------------------------------------------------------------------------------------------
W_N, ZETA = 2 * np.pi * 500, 0.7
G0 = ([W_N**2], [1, 2 * ZETA * W_N, W_N**2])


def from_poles(poles: Any, zeros: Any = (), gain: float = 1.0) -> tuple[list[float], list[float]]:
    b, a = scipy.signal.zpk2tf(list(zeros), list(poles), gain)
    return [float(v) for v in np.atleast_1d(b)], [float(v) for v in a]


# (numerator, denominator, step)
SYSTEMS = {
    "G0 at 10 kHz": (*G0, 1e-4),
    "G0 at 1 kHz": (*G0, 1e-3),
    "order 1": ([3.0], [2.0, 5.0], 0.1),
    "order 2, direct term": ([1.0, 2.0, 3.0], [2.0, 1.0, 4.0], 0.2),
    "order 3": (*from_poles([-1, -2 + 3j, -2 - 3j], [-4]), 0.05),
    "order 4": (*from_poles([-1, -5, -2 + 30j, -2 - 30j], [-4, -6]), 0.01),
    "order 5": (*from_poles([-1, -2, -3, -4, -5]), 0.1),
    "order 6": (*from_poles([-1 + 1j, -1 - 1j, -1 + 2j, -1 - 2j, -1 + 3j, -1 - 3j], [-0.5, -0.7]), 0.1),
    "order 7": (*from_poles([-1, -2, -3, -4, -5, -6, -7], [-1.5, -2.5, -3.5]), 0.05),
    "order 8": (*from_poles([-1, -2, -3, -4, -5, -6, -7, -8], [-2.5]), 0.05),
    "stiff": (*from_poles([-1, -1e6]), 1e-2),
    "integrator": ([2.0], [1.0, 3.0, 0.0], 0.1),
    "two integrators": ([1.0], [1.0, 0.0, 0.0], 1e-4),
    "unstable": ([1.0], [1.0, 0.5, -4.0], 0.1),
    "b begins with zeros": ([0.0, 0.0, 5.0], [1.0, 2.0, 5.0], 0.1),
}


def exact_response(b: Any, a: Any, h: float, u: Array, foh: bool) -> Array:
    """Response in 60 digits: e^(augmented matrix) of the unscaled canonical form, by mpmath."""
    with mp.workdps(60):
        n = len(a) - 1
        lead = mp.mpf(float(a[0]))
        den = [mp.mpf(float(v)) / lead for v in a]
        num = [mp.mpf(0)] * (n + 1 - len(b)) + [mp.mpf(float(v)) / lead for v in b]
        M = mp.zeros(n + 2)
        for i in range(n - 1):
            M[i, i + 1] = mp.mpf(h)
        for i in range(n):
            M[n - 1, i] = -den[n - i] * mp.mpf(h)
        M[n - 1, n] = mp.mpf(h)
        M[n, n + 1] = 1
        # scaling and squaring with so many digits that no error can add up to a visible one
        E, small, squarings = mp.eye(n + 2), M, 0
        while mp.mnorm(small, 1) > mp.mpf(1) / 1024:
            small, squarings = small / 2, squarings + 1
        term = mp.eye(n + 2)
        for k in range(1, 25):
            term = term * small / k
            E = E + term
        for _ in range(squarings):
            E = E * E
        x, y = mp.zeros(n, 1), []
        for k, now in enumerate(u):
            if k:
                before = mp.mpf(float(u[k - 1] if foh else now))
                slope = mp.mpf(float(now)) - before
                x = E[:n, :n] * x + E[:n, n] * before + E[:n, n + 1] * slope
            y.append(sum((num[n - i] - num[0] * den[n - i]) * x[i] for i in range(n)) + num[0] * mp.mpf(float(now)))
        return np.array([float(v) for v in y])


@pytest.mark.some(10)
@pytest.mark.parametrize("hold", ["zoh", "foh"])
@pytest.mark.parametrize("system", SYSTEMS)
def test_transfer_function_in_60_digits(system: str, hold: str) -> None:
    b, a, h = SYSTEMS[system]
    u = rng().normal(size=60)
    y = blocks.TransferFunction(b=b, a=a, hold=hold)(u, h)
    exact = exact_response(b, a, h, u, hold == "foh")
    assert np.abs(y - exact).max() <= 1e-13 * np.abs(exact).max()


@pytest.mark.parametrize("hold", ["zoh", "foh"])
@pytest.mark.parametrize("system", [s for s in SYSTEMS if s not in ("stiff", "unstable", "b begins with zeros")])
def test_transfer_function_against_scipy(system: str, hold: str) -> None:
    """Another path: state space by scipy.signal, whose conditioning sets the tolerance."""
    b, a, h = SYSTEMS[system]
    u = rng(1).normal(size=300)
    y = blocks.TransferFunction(b=b, a=a, hold=hold)(u, h)
    if hold == "foh":
        reference = scipy.signal.lsim((b, a), u, np.arange(len(u)) * h, interp=True)[1]
        reference = reference + y[0] - reference[0]  # lsim has no state at rest other than 0: nothing to add
    else:
        A, B, C, D, _ = scipy.signal.cont2discrete(scipy.signal.tf2ss(b, a), h, method="zoh")
        x, reference = np.zeros(len(A)), np.empty(len(u))
        for k in range(len(u)):
            x = A @ x + B[:, 0] * u[k] if k else x
            reference[k] = C[0] @ x + D[0, 0] * u[k]
    assert np.abs(y - reference).max() <= 1e-8 * np.abs(reference).max()


def test_transfer_function_g0_to_the_last_place() -> None:
    """500 Hz at 10 kHz: the scaled form loses nothing over 100 000 steps of an alternating input."""
    h, n = 1e-4, 100_000
    w_d, decay = W_N * np.sqrt(1 - ZETA**2), ZETA * W_N
    y = blocks.TransferFunction(b=G0[0], a=G0[1])(np.r_[0, np.ones(n)], h)
    t = np.arange(60) * h
    exact = 1 - np.exp(-decay * t) * (np.cos(w_d * t) + decay / w_d * np.sin(w_d * t))
    assert np.abs(y[:60] - exact).max() <= 1e-15 * 4
    assert abs(y[-1] - 1) <= 1e-15


def test_transfer_function_does_not_depend_on_the_unit_of_time() -> None:
    u = rng(2).normal(size=100)
    slow = blocks.TransferFunction(b=[1], a=[1, 1.4, 1])(u, 0.5)
    fast = blocks.TransferFunction(b=[1], a=[2.0**-60, 1.4 * 2.0**-30, 1])(u, 0.5 * 2.0**-30)
    assert fast.tobytes() == slow.tobytes()


def test_transfer_function_steady_start() -> None:
    y = blocks.TransferFunction(b=G0[0], a=G0[1], start="steady", hold="foh")(np.full(50, -0.7), 1e-4)
    assert np.abs(y + 0.7).max() <= 1e-15


def test_transfer_function_follows_a_step_that_changes() -> None:
    """Exact for each step size: 10 steps of 0.1 and then 20 of 0.05 end where 20 of 0.1 end."""
    graph = blocks.TransferFunction(b=[1], a=[1, 0.4, 9]).graph
    ends = []
    for sizes in ([0.1] * 20, [0.1] * 10 + [0.05] * 20):
        unit, t = Unit(graph), 0.0
        unit.initialize(0.0)
        unit.set("u", 1.0)
        for h in sizes:
            unit.do_step(t, h)
            t += h
        ends.append(unit.get("y"))
    assert abs(ends[0] - ends[1]) <= 1e-15


@pytest.mark.parametrize(("values", "words"), [
    ({"b": [1, 2, 3], "a": [1, 2]}, "higher degree"),
    ({"b": [1], "a": [0, 1, 2]}, "must not be 0"),
    ({"b": [1], "a": [1, 0], "start": "steady"}, "no steady state"),
    ({"b": [1], "a": [1e-300, 1e300]}, "too small relative to the others"),
])  # fmt: skip
def test_transfer_function_refuses(values: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words) as e:
        blocks.TransferFunction(**values)(np.zeros(3))
    assert "transfer_function" in str(e.value)
    assert "\n" not in str(e.value)


@pytest.mark.parametrize(("h", "words"), [(1e300, "step is too long"), (400.0, "the output overflows")])
def test_transfer_function_refuses_a_step_beyond_numbers(h: float, words: str) -> None:
    unit = Unit(blocks.TransferFunction(b=[1], a=[1, -2]).graph)
    unit.initialize(0.0, u=1.0)
    unit.do_step(0.0, 0.5)
    before = unit.state
    with pytest.raises(InputError, match=words):
        unit.do_step(0.5, h)
    assert unit.state.tobytes() == before.tobytes()
    unit.do_step(0.5, 0.5)
    assert unit.get("y") == pytest.approx((np.exp(2) - 1) / 2, rel=1e-14)


# ---- amplifier ------------------------------------------------------------------------------------------------------
@pytest.mark.turn("blocks and other integrators")
def test_amplifier_follows_its_equation() -> None:
    """Against a solver in steps of a hundredth; the limits take effect, and the steps do not change the voltage."""
    values = {"u_min": -20.0, "u_max": 80.0, "i_max": 0.25, "C": 1.8e-6, "f_b": 2e3}
    h, finer = 1e-4, 100
    command = 60 + 70 * np.sin(2 * np.pi * 300 * h * np.arange(60))
    made = blocks.Amplifier(**values)
    y, excess = made(command, h).T
    fine = made(np.append(command[0], np.repeat(command[1:], finer)), h / finer)[::finer, 0]
    assert np.abs(y - fine).max() <= 1e-11
    omega, rate, v, expected = 2 * np.pi * 2e3, 0.25 / 1.8e-6, 0.0, [0.0]
    for wanted in np.clip(command[1:], -20, 80):
        for _ in range(1000):  # Heun's rule
            first = np.clip(omega * (wanted - v), -rate, rate)
            second = np.clip(omega * (wanted - v - first * h / 1000), -rate, rate)
            v += (first + second) / 2 * h / 1000
        expected.append(v)
    assert np.abs(y - expected).max() <= 1e-4
    assert np.abs(np.diff(y)).max() == pytest.approx(rate * h)
    assert y.max() <= 80
    assert excess.max() > 45  # the command goes to 130 V
    assert (excess == 0).mean() > 0.2
