"""Dynamics, controllers and sources against scipy.signal, mpmath, closed forms and statistics."""

from __future__ import annotations

from typing import Any

import mpmath as mp
import numpy as np
import pytest
import scipy.signal
import scipy.stats
from numpy.typing import NDArray

from hystfmu import blocks
from hystfmu.errors import InputError
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.unit import Unit

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


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"b": [1, 2, 3], "a": [1, 2]}, "higher degree"),
        ({"b": [1], "a": [0, 1, 2]}, "must not be 0"),
        ({"b": [1], "a": [1, 0], "start": "steady"}, "no steady state"),
        ({"b": [1], "a": [1e-300, 1e300]}, "too small beside the others"),
    ],
)
def test_transfer_function_refuses(values: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words) as e:
        blocks.TransferFunction(**values)(np.zeros(3))
    assert "transfer_function" in str(e.value)
    assert "\n" not in str(e.value)


@pytest.mark.parametrize(("h", "words"), [(1e300, "step is too long"), (400.0, "leaves the range of numbers")])
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


# ---- delay ----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("n", [1, 2, 7, 100])
def test_delay_shifts(n: int) -> None:
    u = rng(3).normal(size=250)
    assert blocks.Delay(n=n, y0=-3.0)(u).tobytes() == np.r_[np.full(n, -3.0), u][: len(u)].tobytes()


# ---- controllers ----------------------------------------------------------------------------------------------------
def controller_rows(n: int = 200) -> Array:
    return np.cumsum(rng(4).normal(size=(n, 3)), axis=0) * 0.1


def difference(e: Array, tau: float, h: float) -> Array:
    d = np.zeros_like(e)
    for k in range(1, len(e)):
        d[k] = (tau * d[k - 1] + e[k] - e[k - 1]) / (tau + h)
    return d


def integral(e: Array, h: float) -> Array:
    return np.r_[0, np.cumsum(e[1:])] * h


@pytest.mark.parametrize("tau", [0.0, 2e-3])
def test_pid_is_its_definition(tau: float) -> None:
    """With the tuned values of the 10 kHz scenarios."""
    rows, h = controller_rows(), 1e-4
    e = rows[:, 0] - rows[:, 1]
    expected = rows[:, 2] + 1.2 * e + 10700 * integral(e, h) + 6e-4 * difference(e, tau, h)
    u = blocks.Pid(Kp=1.2, Ki=10700, Kd=6e-4, tau=tau)(rows, h)
    assert np.abs(u - expected).max() <= 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("tau", [0.0, 2e-3])
def test_sliding_mode_is_its_definition(tau: float) -> None:
    rows, h = controller_rows(), 1e-4
    e = rows[:, 1] - rows[:, 0]
    s = difference(e, tau, h) + 1300 * e + 1.56e7 * integral(e, h)
    expected = rows[:, 2] - 6.5e-4 * s - 1.05e-4 * s / (np.abs(s) + 7.0)
    y = blocks.SlidingMode(lam=1300, eta=6.5e-4, rho=1.05e-4, epsilon=7.0, k_i=1.56e7, tau=tau)(rows, h)
    assert np.abs(y[:, 0] - expected).max() <= 1e-12 * np.abs(expected).max()
    assert np.abs(y[:, 1] - s).max() <= 1e-12 * np.abs(s).max()


CONTROLLERS = {
    "pid": {"Kp": 1.0, "Ki": 50.0, "Kd": 0.0},
    "sliding_mode": {"lam": 100.0, "eta": 0.01, "rho": 0.01, "epsilon": 1.0, "k_i": 5000.0},
}


@pytest.mark.parametrize("name", CONTROLLERS)
def test_no_kick_at_the_start(name: str) -> None:
    """The first error is no jump: with a huge derivative gain, u at the start has no part of it."""
    strong = {"Kp": 0.0, "Kd": 1e6} if name == "pid" else {"lam": 0.0, "eta": 1e6}
    unit = Unit(Graph.single(Node(name, name, {}, strong)))
    unit.initialize(0.0, y_d=5.0, y=-3.0, u_ff=0.25)
    assert unit.get("u") == 0.25
    unit.do_step(0.0, 1e-6)  # the same error again: still no derivative
    assert abs(unit.get("u") - 0.25) <= 1e-9


@pytest.mark.parametrize("name", CONTROLLERS)
def test_limits_and_anti_windup(name: str) -> None:
    """Ten seconds against the limit must not be paid back: u leaves it as soon as the error changes its sign."""
    h = 1e-3
    rows = np.zeros((10_200, 3))
    rows[:10_000, 0], rows[10_000:, 0] = 1.0, -0.02
    limited = {**CONTROLLERS[name], "u_min": -0.6, "u_max": 0.5}
    u = Graph.single(Node(name, name, {}, limited)).run(rows, h).reshape(len(rows), -1)[:, 0]
    assert u.max() <= 0.5
    assert u.min() >= -0.6
    assert u[9_999] == 0.5
    assert u[10_001] < 0.5
    free = Graph.single(Node(name, name, {}, CONTROLLERS[name])).run(rows, h).reshape(len(rows), -1)[:, 0]
    assert free[10_150] > 100  # the same controller without limits has wound up


@pytest.mark.parametrize("name", CONTROLLERS)
def test_limits_must_be_in_order(name: str) -> None:
    graph = Graph.single(Node(name, name, {}, {"u_min": 1.0}))
    unit = Unit(graph)
    unit.set("u_max", 0.5)
    with pytest.raises(InputError, match="u_min must not be greater than u_max"):
        unit.initialize(0.0)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_integral_action_removes_a_constant_disturbance(name: str) -> None:
    """A first-order plant pushed by 0.3: the error ends at 0 with the integral and does not without it."""
    errors = []
    for gains in (CONTROLLERS[name], {**CONTROLLERS[name], "Ki" if name == "pid" else "k_i": 0.0}):
        nodes = [
            Node("plant", "transfer_function", {}, {"b": [1.0], "a": [0.05, 1.0]}),
            Node("control", name, {}, gains),
            Node("push", "sum", {"n": 1}, {"offset": 0.3}),
        ]
        wires = [("plant.y", "control.y"), ("control.u", "push.u"), ("push.y", "plant.u")]
        graph = Graph(nodes, wires, [Input("r", ("control.y_d", "control.u_ff"))], [Output("y", "plant.y")])
        errors.append(abs(graph.run(np.full(5000, 0.5), 1e-3)[-1] - 0.5))
    assert errors[0] <= 1e-12
    assert errors[1] >= 0.01


def test_sliding_mode_meets_the_exact_ultimate_bound() -> None:
    """s' = -eta s - rho s/(|s| + eps) + d, |d| <= D: the worst d holds s at the exact bound, not at eps/(eta - 1).

    A plant 1/s^2 with lam = 0 has s' = u + d.  The exact bound is the root of eta s + rho s/(s + eps) = D.
    """
    eta, rho, epsilon, D = 5.0, 1.0, 0.01, 1.0
    q = eta * epsilon + rho - D
    exact = (-q + np.sqrt(q * q + 4 * eta * D * epsilon)) / (2 * eta)
    printed = epsilon / (eta - 1)
    assert exact == pytest.approx(0.0400, abs=5e-5)
    assert printed == pytest.approx(0.0025)
    nodes = [
        Node("plant", "transfer_function", {}, {"b": [1.0], "a": [1.0, 0.0, 0.0]}),
        Node("control", "sliding_mode", {}, {"lam": 0.0, "eta": eta, "rho": rho, "epsilon": epsilon}),
    ]
    wires = [("plant.y", "control.y"), ("control.u", "plant.u")]
    graph = Graph(nodes, wires, [Input("d", ("control.u_ff",))], [Output("s", "control.s")])
    s = graph.run(np.full(60_000, D), 1e-4)
    assert abs(s[-1] - exact) <= 1e-6
    assert s.max() <= exact * (1 + 1e-3)
    assert s[-1] > 10 * printed
    switching = np.sign(np.sin(2 * np.pi * 0.7 * np.arange(60_000) * 1e-4)) * D  # any other d stays inside
    assert np.abs(graph.run(switching, 1e-4)).max() <= exact * (1 + 1e-3)


def test_feedforward_through_g0_gives_the_reference() -> None:
    """v drives G0 (foh, a fine step): the output is the reference once the start has decayed."""
    h = 1e-5
    nodes = [
        Node("r", "reference", {"m": 1}, {"amplitude": 2.0, "frequency": 50.0, "phase": 0.4}),
        Node("ff", "feedforward", {}, {"f_n": 500.0, "zeta": 0.7, "gain": 3.0}),
        Node("g0", "transfer_function", {}, {"b": [3 * W_N**2], "a": G0[1], "hold": "foh", "start": "steady"}),
    ]
    wires = [("r.r_lead", "ff.r"), ("r.dr_lead", "ff.dr"), ("r.ddr_lead", "ff.ddr"), ("ff.v", "g0.u")]
    graph = Graph(nodes, wires, (), [Output("r", "r.r"), Output("y", "g0.y")])
    y = graph.run(np.zeros((4000, 0)), h)
    settled = y[1000:]
    assert np.abs(settled[:, 0] - settled[:, 1]).max() <= 3e-6  # the ramps of the hold: (2 pi 50 h)^2 / 12


def test_preview_of_half_a_sample_makes_up_for_the_hold() -> None:
    """At 10 kHz and 100 Hz a zero-order hold costs 2-3 % of amplitude; taken at t + h/2, less than a tenth of that."""
    errors = []
    for lead in (0.0, 0.5e-4):
        nodes = [
            Node("r", "reference", {"m": 1}, {"frequency": 100.0, "lead": lead}),
            Node("ff", "feedforward"),
            Node("g0", "transfer_function", {}, {"b": G0[0], "a": G0[1]}),
        ]
        wires = [("r.r_lead", "ff.r"), ("r.dr_lead", "ff.dr"), ("r.ddr_lead", "ff.ddr"), ("ff.v", "g0.u")]
        graph = Graph([nodes[2], *nodes[:2]], wires, (), [Output("r", "r.r"), Output("y", "g0.y")], sort=False)
        y = graph.run(np.zeros((2000, 0)), 1e-4)[500:]
        errors.append(np.abs(y[:, 0] - y[:, 1]).max())
    assert 0.01 <= errors[0] <= 0.04
    assert errors[1] <= 0.1 * errors[0]


# ---- sources --------------------------------------------------------------------------------------------------------
REFERENCES: dict[str, dict[str, Any]] = {
    "sine": {"frequency": 3.0, "phase": 0.5},
    "triangle": {"frequency": 3.0, "phase": 0.5},
    "decaying_sine": {"frequency": 3.0, "decay": 0.8},
    "multisine": {"f": [1.0, 2.5, 7.0], "a": [1.0, 0.5, 0.1], "ph": [0.0, 1.0, 2.0]},
    "steps": {"levels": [1.0, -2.0, 0.5], "T": 0.31},
    "random_reversals": {"m": 12, "frequency": 3.0, "seed": 5},
}


@pytest.mark.parametrize("shape", REFERENCES)
def test_reference_derivatives_and_lead(shape: str) -> None:
    """Derivatives against central differences of the signal itself; the preview against a later sample."""
    h, ahead = 1e-4, 25
    made = blocks.Reference(shape=shape, amplitude=1.7, offset=0.3, lead=ahead * h, **REFERENCES[shape])
    r, r_lead, dr, ddr = made(np.zeros((15_000, 0)), h).T
    assert np.abs(r[ahead:] - r_lead[:-ahead]).max() <= 1e-10 or shape == "steps"
    assert np.mean(np.abs(r[ahead:] - r_lead[:-ahead]) > 1e-10) <= 1e-3  # a jump may fall on either sample
    d1, d2 = (r_lead[2:] - r_lead[:-2]) / (2 * h), (dr[2:] - dr[:-2]) / (2 * h)
    curvature = np.diff(r_lead, 2) / h**2
    size = 1 + np.abs(ddr).max()
    corners = np.abs(curvature - ddr[1:-1]) > 0.01 * size
    away = np.convolve(corners, np.ones(7), "same") == 0
    assert away.mean() > 0.99
    assert np.abs(d1 - dr[1:-1])[away].max() <= 1e-4 * (1 + np.abs(dr).max())
    assert np.abs(d2 - ddr[1:-1])[away].max() <= 2e-3 * size


def test_random_reversals_are_nested_random_and_reproducible() -> None:
    m, f, h = 400, 5.0, 1e-3
    made = [blocks.Reference(shape="random_reversals", m=m, frequency=f, seed=s) for s in (1, 1, 2)]
    a, b, c = (x(np.zeros((41_000, 0)), h)[:, 0] for x in made)
    assert a.tobytes() == b.tobytes()
    assert np.abs(a - c).max() > 0.5
    levels = a[:: round(1 / (2 * f * h))][: m + 1]
    assert levels[0] == 0
    moves = np.diff(levels)
    assert (moves[::2] > 0).all()
    assert (moves[1::2] < 0).all()
    assert np.abs(levels).max() < 1
    # each level is uniform between the last one and the bound: its share of the way is uniform on (0, 1)
    bounds = np.where(np.arange(m) % 2, -1, 1)
    share = moves / (bounds - levels[:-1])
    assert scipy.stats.kstest(share, "uniform").pvalue > 0.01
    assert (a[round(m / (2 * f * h)) + 1 :] == levels[-1]).all()  # then it rests


def test_reference_keeps_its_phase_at_late_times() -> None:
    """A sine of 100 Hz after 1e6 s: the only error is that of the time itself (1e-10 s)."""
    t0 = 1e6
    y = blocks.Reference(m=1, frequency=100.0).graph.run(np.zeros((50, 0)), 1e-3, t0)[:, 0]
    t = t0 + np.arange(50) * 1e-3
    assert np.abs(y - np.sin(2 * np.pi * ((100 * t) % 1))).max() <= 1e-6


def test_disturbance() -> None:
    h = 0.1
    d = blocks.Disturbance(step=0.5, t_step=0.7, amplitude=0.2, frequency=3.0, phase=0.4)(np.zeros((40, 0)), h)
    t = np.arange(40) * h
    expected = 0.5 * (np.arange(40) >= 7) + 0.2 * np.sin(2 * np.pi * 3 * t + 0.4)
    assert np.abs(d - expected).max() <= 1e-13


def test_noise_is_white_and_gaussian() -> None:
    n = 200_000
    w = blocks.Noise(sigma=2.0, seed=42)(np.zeros((n, 0))) / 2.0
    # five standard errors of each estimate
    assert abs(w.mean()) <= 5 / np.sqrt(n)
    assert abs(w.var() - 1) <= 5 * np.sqrt(2 / n)
    assert abs((w**3).mean()) <= 5 * np.sqrt(15 / n)
    assert abs((w**4).mean() - 3) <= 5 * np.sqrt(96 / n)
    assert scipy.stats.kstest(w, "norm").pvalue > 0.001
    spectrum = np.abs(np.fft.rfft(w)) ** 2 / n
    correlation = np.fft.irfft(spectrum)[1:200]
    assert np.abs(correlation).max() <= 5 / np.sqrt(n)
    squares = w**2 - 1  # no dependence of size on size either
    assert abs(np.mean(squares[1:] * squares[:-1])) <= 5 * 2 / np.sqrt(n)


def test_noise_seeds_are_independent_and_reproducible() -> None:
    n = 50_000
    w = [blocks.Noise(seed=s)(np.zeros((n, 0))) for s in (7, 7, 8, 2**31 - 1)]
    assert w[0].tobytes() == w[1].tobytes()
    for other in w[2:]:
        for shift in range(-3, 4):
            assert abs(np.mean(w[0] * np.roll(other, shift))) <= 5 / np.sqrt(n)


def test_noise_advances_once_per_step_whatever_the_step() -> None:
    graph = blocks.Noise(seed=3).graph
    straight = graph.run(np.zeros((20, 0)), 1e-3)
    unit = Unit(graph)
    unit.initialize(5.0)
    values, t = [unit.get("w")], 5.0
    for h in rng().uniform(0.1, 1, 19):
        unit.do_step(t, h)
        t += h
        assert unit.get("w") == unit.get("w")
        values.append(unit.get("w"))
    assert np.array(values).tobytes() == straight.tobytes()
