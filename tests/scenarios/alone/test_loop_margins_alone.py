"""An opened loop made by hand: its response, poles, margins and noise against closed forms, without a scenario."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hystfmu.design.repetitive import PeriodMemory
from hystfmu.scenario.loop.opened import OpenedLoop, _covariance, _turns
from hystfmu.scenario.loop.plant import PlantSide, held
from hystfmu.scenario.system.system import behind

H = 0.01
TAU = 0.05
GAIN = np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.ones((1, 1))  # a plant without states
LAG = np.array([[-1 / TAU]]), np.array([[1 / TAU]]), np.ones((1, 1)), np.zeros((1, 1))


def integrator(k: float, *more: Any) -> Any:
    """u = -k h sum y."""
    return np.ones((1, 1)), np.array([[-k * H]]), np.ones((1, 1)), np.array([[-k * H]])


def loop(controller: Any, plant: Any = GAIN, delay: float = 0.0, **more: Any) -> OpenedLoop:
    return OpenedLoop(None, controller, plant, H, (0.5, 2.0), ("a", "b"), PlantSide((), delay), **more)  # type: ignore[arg-type]


# ---- what comes late ------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("delay", [0.0, 0.5, 1.0, 1.5, 2.0, 3.0])
def test_a_gain_gives_the_last_command_that_has_come(delay: float) -> None:
    """z^-(1 + floor(delay)): what came after a part of a step is there at its end."""
    A, B, C, D = held((*GAIN[:3], np.full((1, 1), 2.5)), H, delay)
    past = 1 + int(np.floor(delay))
    assert A.shape == (past, past)
    x, got = np.zeros((past, 1)), []
    for k in range(6):
        got.append(float((C @ x + D).item()))
        x = A @ x + B * (k == 0)
    assert got == [2.5 * (k == past) for k in range(6)]


@pytest.mark.parametrize("delay", [0.0, 0.25, 1.0, 1.25, 2.0])
def test_a_lag_follows_its_closed_form(delay: float) -> None:
    """x(t) = 1 - exp(-(t - delay)/tau) for a step at 0, at the grid points."""
    A, B, C, D = held(LAG, H, delay)
    assert len(A) == 1 + int(np.ceil(delay))
    assert not D.any()
    x = np.zeros((len(A), 1))
    for k in range(8):
        want = -np.expm1(-max(k - delay, 0) * H / TAU)
        assert float((C @ x).item()) == pytest.approx(want, abs=1e-14)
        x = A @ x + B


@pytest.mark.parametrize("ramp", [1.0, 0.4])
@pytest.mark.parametrize("delay", [0.0, 0.25, 0.8, 1.25, 2.0])
def test_a_lag_behind_a_ramp_follows_its_closed_form(delay: float, ramp: float) -> None:
    """The mean of the answers to steps that come between the delay and the delay and the ramp."""
    A, B, C, _ = held(LAG, H, delay, ramp * H)
    x = np.zeros((len(A), 1))
    for k in range(9):
        after, before = max(k - delay, 0.0) * H, max(k - delay - ramp, 0.0) * H
        want = (after - before + TAU * (np.expm1(-after / TAU) - np.expm1(-before / TAU))) / (ramp * H)
        assert float((C @ x).item()) == pytest.approx(want, abs=1e-13)
        x = A @ x + B


def test_rounding_of_a_delay_is_no_fraction() -> None:
    whole = held(LAG, H, 2.0)
    for near in (2.0 - 1e-13, 2.0 + 1e-10):
        for a, b in zip(whole, held(LAG, H, near), strict=True):
            assert a.tolist() == b.tolist()
    assert len(held(LAG, H, 2.0 + 1e-8)[0]) == len(whole[0]) + 1
    for near in (2.0 - 1e-13, 2.0, 2.0 + 1e-10, 2.0 + 1e-8):
        assert len(held(GAIN, H, near)[0]) == 3


@pytest.mark.parametrize("ramp", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("delay", [0.0, 0.25, 0.5, 0.8, 1.0, 1.75, 3.0])
def test_a_gain_beside_lags_follows_a_command_of_hundredths_of_a_step(delay: float, ramp: float) -> None:
    """Creep y = 0.6 u + 0.3 q_1 - 0.2 q_2, q' = (u - q) / T: each hundredth is a line of its own, solved by hand."""
    T, w, gain, fine = np.array([TAU, 0.4 * H]), np.array([0.3, -0.2]), 0.6, 100
    plant = np.diag(-1 / T), (1 / T)[:, None], w[None], np.full((1, 1), gain)
    u = np.random.default_rng().normal(size=20)
    t = np.arange(fine * len(u) + 1) / fine  # steps; the command on its lines, as it is just before t
    risen = [
        np.clip((t - k - delay) / ramp, 0, 1) if ramp else np.where(t > k + delay + 1e-9, 1.0, 0.0)
        for k in range(len(u))
    ]
    v = sum(np.diff(u, prepend=0.0)[k] * r for k, r in enumerate(risen))
    q, expected, d = np.zeros(2), [0.0], H / fine
    e = np.exp(-d / T)
    for k in range(fine * len(u)):
        first = v[k] if ramp else v[k + 1]  # a line, or a jump at its start
        slope = (v[k + 1] - first) / d
        q = e * q + (1 - e) * first + slope * (d - T * (1 - e))
        if (k + 1) % fine == 0:
            expected.append(w @ q + gain * v[k + 1])
    A, B, C, D = held(plant, H, delay, ramp * H)
    assert not D.any()
    x, found = np.zeros(len(A)), []
    for value in u:
        found.append((C @ x)[0])
        x = A @ x + B[:, 0] * value
    assert found == pytest.approx(expected[:-1], abs=1e-11)


# ---- an integrator around a gain -----------------------------------------------------------------------------------
def test_the_poles_of_an_integral_loop() -> None:
    """y_(k+1) = u_k, u_k = u_(k-1) - k h y_k: z^2 - z + slope k h z = 0 has the poles 0 and 1 - slope k h."""
    made = loop(integrator(30.0))
    for slope in (0.1, 1.0, 3.0, 6.0, 7.0):
        pole = abs(1 - slope * 30.0 * H)
        assert made.radius(slope, 0.0) == pytest.approx(pole, abs=1e-9)
        assert made.stable(slope, 0.0) == (pole < 1)
    # one step later: z^2 - z + a = 0
    for slope in (0.5, 3.0, 4.0):
        want = np.abs(np.roots([1, -1, slope * 30.0 * H])).max()
        assert made.radius(slope, 1.0) == pytest.approx(want, abs=1e-9)
        assert replace(made, side=PlantSide((), 1.0)).radius(slope, 0.0) == pytest.approx(want, abs=1e-9)


def test_the_response_of_an_integral_loop() -> None:
    """L = slope k h z / (z - 1) z^-(1 + delay)."""
    made = loop(integrator(30.0))
    z = np.exp(1j * made._angles)
    for slope, delay in [(1.0, 0.0), (0.7, 2.0)]:
        want = slope * 30.0 * H * z / (z - 1) * z ** -(1 + delay)
        assert made.response(slope, delay) == pytest.approx(want, rel=1e-9)
        assert made.open_loop(slope, delay)(z[:50]) == pytest.approx(want[:50], rel=1e-9)


def test_the_margins_of_an_integral_loop() -> None:
    """|L| = 2 g |sin(w/2)|^-1 / 4 ...: crossover at sin(w/2) = g/2, phase margin 90 degrees - w/2, gain margin 2/g."""
    g = 0.3
    found = loop(integrator(g / H)).margins()
    w = 2 * np.arcsin(g / 2)
    assert found.phase_deg == pytest.approx(90 - np.degrees(w) / 2, abs=1e-6)
    assert found.gain_db == pytest.approx(20 * np.log10(2 / g), abs=1e-6)


def test_the_worst_peak_over_the_sector() -> None:
    """1 / |1 + L| over slopes of 0.5 to 2: the steepest one; infinite where a slope is unstable."""
    made = loop(integrator(30.0))
    z = np.exp(1j * made._angles)
    nearest = min(np.abs(1 + s * 0.3 / (z - 1)).min() for s in np.linspace(0.5, 2, 7))
    assert made.worst_peak_db() == pytest.approx(-20 * np.log10(nearest), abs=1e-9)
    assert loop(integrator(120.0)).worst_peak_db() == np.inf
    assert loop(integrator(30.0)).worst_peak_db(3.0) == np.inf


def test_the_delays_up_to_which_it_is_stable() -> None:
    """z^2 - z + a is stable below a = 1; z^3 - z^2 + a below a = 0.618; a is at most twice the gain."""
    assert loop(integrator(45.0)).stable_to((0.0, 1.0, 2.0)) == 1.0
    assert loop(integrator(45.0)).stable_to((2.0, 1.0, 0.0)) == 1.0, "in any order"
    assert loop(integrator(30.0)).stable_to((0.0, 1.0, 2.0)) == 2.0
    assert loop(integrator(80.0)).stable_to((0.0, 1.0)) == 0.0
    assert np.isnan(loop(integrator(120.0)).stable_to((0.0, 1.0)))
    assert loop(integrator(45.0)).stable_at(1.0)
    assert not loop(integrator(45.0)).stable_at(2.0)


def test_the_noise_of_an_integral_loop() -> None:
    """u_k = (1 - a) u_(k-1) - g v_k, a = slope g: variance g^2 / (1 - (1 - a)^2) of white noise v at the sensor."""
    for g, slope in [(0.3, 1.0), (0.3, 0.5), (0.9, 2.0)]:
        a = slope * g
        want = g / np.sqrt(1 - (1 - a) ** 2)
        assert loop(integrator(g / H)).noise_gain(slope) == pytest.approx(want, rel=1e-9)
    assert loop(integrator(1.2 / H)).noise_gain(2.0) == np.inf


# a plant of two states whose output is twice the first one, and a controller with a state of its own
LAG2 = (
    np.array([[-20.0, 7.0], [0.0, -30.0]]), np.array([[0.0], [30.0]]), np.array([[2.0, 0.0]]), np.zeros((1, 1)),
)  # fmt: skip
LEAD = np.array([[0.4]]), np.array([[0.5]]), np.array([[-0.3]]), np.array([[-0.6]])


@pytest.mark.parametrize(("slope", "delay"), [(1.0, 0.0), (0.6, 0.0), (0.6, 1.0), (1.4, 2.5)])
def test_noise_and_poles_of_a_loop_stepped_by_hand(slope: float, delay: float) -> None:
    """Each sample of the noise is an impulse: the energy of the command that it makes, and how fast that decays."""
    made = loop(LEAD, LAG2)
    F, G, H_, _ = held(LAG2, H, delay)
    A, B, C, D = (m.item() for m in LEAD)
    x, w, commands = np.zeros((len(F), 1)), 0.0, []
    for k in range(400):
        y = slope * (H_ @ x).item() + (k == 0)
        u = C * w + D * y
        w = A * w + B * y
        x = F @ x + G * u
        commands.append(u)
    assert made.noise_gain(slope, delay) == pytest.approx(np.sqrt(np.sum(np.square(commands))), rel=1e-9)
    late = [abs(v) for v in commands]
    decay = (max(late[260:300]) / max(late[60:100])) ** (1 / 200)
    assert made.radius(slope, delay) == pytest.approx(decay, abs=0.01)
    z = np.exp(1j * made._angles[::40])
    K = D + C * B / (z - A)
    plant = [(H_ @ np.linalg.solve(v * np.eye(len(F)) - F, G)).item() for v in z]
    assert made.response(slope, delay)[::40] == pytest.approx(-slope * K * np.array(plant), rel=1e-8)


def test_without_further_delay_is_the_default() -> None:
    made = loop(LEAD, LAG2)
    memory = replace(loop(WITH_MEMORY, LAG2), memories=(repetitive(40, 0.5, 0.2),))
    for of, at in [(made.margins, vars(made.margins(1.0, 0.0))), (made.margins, vars(made.margins(slope=1.0)))]:
        assert vars(of()) == at
    assert made.noise_gain() == made.noise_gain(1.0, 0.0) != made.noise_gain(1.0, 1.0)
    assert made.worst_peak_db() == made.worst_peak_db(0.0) != made.worst_peak_db(1.0)
    assert memory.learning() == memory.learning(1.0, 0.0) != memory.learning(1.0, 2.0)
    assert memory.learning() != memory.learning(2.0, 0.0)
    assert made.response().tolist() == made.response(1.0, 0.0).tolist() != made.response(1.0, 1.0).tolist()


def test_covariance_solves_its_equation() -> None:
    rng = np.random.default_rng(0)
    M, N = rng.normal(size=(4, 4)), rng.normal(size=(4, 2))
    M *= 0.95 / np.abs(np.linalg.eigvals(M)).max()
    X = _covariance(M, N)
    assert pytest.approx(M @ X @ M.T + N @ N.T, rel=1e-9) == X


# ---- broken elsewhere ----------------------------------------------------------------------------------------------
def test_a_loop_broken_at_a_signal_closes_the_rest() -> None:
    """Constant gains: L = -(d11 + d10 G d01 / (1 - d00 G)) with G = slope / z."""
    D = np.array([[-0.4, 0.7], [0.9, -0.2]])
    broken = np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((2, 0)), D
    made = loop(integrator(30.0), broken=broken, at="x.y")
    z = np.exp(1j * made._angles)
    for slope in (1.0, 0.5):
        G = slope / z
        want = -(D[1, 1] + D[1, 0] * G * D[0, 1] / (1 - D[0, 0] * G))
        assert made.response(slope) == pytest.approx(want, rel=1e-9)
    nearest = min(np.abs(1 + made.response(float(s))).min() for s in np.linspace(0.5, 2, 7))
    assert made.worst_peak_db() == pytest.approx(-20 * np.log10(nearest), rel=1e-9)
    low = made.margins(0.5)
    assert low.Ms_db == pytest.approx(-20 * np.log10(np.abs(1 + made.response(0.5)).min()), abs=1e-3)


# ---- a memory of a period ------------------------------------------------------------------------------------------
def repetitive(n: int, q: float, ll: float, lifted: bool = False) -> PeriodMemory:
    return PeriodMemory(n, np.array([q]), np.array([ll]), lifted)


# inputs: output of the plant, correction; outputs: command, error.  A gain: u = p e + w, e = -y
P = 0.4
WITH_MEMORY = np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((2, 0)), np.array([[-P, 1.0], [-1.0, 0.0]])


def test_corrections_shrink_by_their_factor() -> None:
    """Error of the correction: T = -G / (1 + P G); factor q - ll T ... at every frequency, G = slope / z."""
    memory = repetitive(40, 0.9, 0.5)
    made = loop(WITH_MEMORY, memories=(memory,))
    z = np.exp(1j * made._angles)
    for slope in (1.0, 0.5):
        G = slope / z
        want = np.abs(memory.factor(made._angles, -G / (1 + P * G))).max()
        assert made.learning(slope) == pytest.approx(want, rel=1e-9)
    assert np.isnan(loop(integrator(30.0)).learning())


def test_a_memory_is_closed_around_the_controller() -> None:
    memory = repetitive(40, 0.9, 0.5)
    made = loop(WITH_MEMORY, memories=(memory,))
    z = np.exp(1j * made._angles)
    R = memory.response(made._angles)
    assert made.response() == pytest.approx((P + R) / z, rel=1e-9)
    assert made.open_loop(0.5, 0.0)(z[:50]) == pytest.approx(0.5 * P / z[:50], rel=1e-9), "without memories"
    both = np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((2, 0)), np.array([[-P, 2.0], [-3.0, 0.25]])
    K = loop(both, memories=(memory,)).response() * -z
    assert pytest.approx(-P + 2.0 * R * -3.0 / (1 - 0.25 * R), rel=1e-9) == K


def test_the_poles_of_a_memory_are_bounded_by_its_factor() -> None:
    n = 40
    made = loop(WITH_MEMORY, memories=(repetitive(n, 0.5, 0.2),))
    plain = replace(made, memories=())
    factor = made.learning()
    assert factor < 1
    assert made.radius(1.0, 0.0) == pytest.approx(max(plain.radius(1.0, 0.0), factor ** (1 / n)), rel=1e-12)
    assert made.stable(1.0, 0.0)
    steep = replace(made, controller=(*WITH_MEMORY[:3], np.array([[-1.5, 1.0], [-1.0, 0.0]])))
    assert steep.radius(1.0, 0.0) == pytest.approx(1.5)
    assert not steep.stable(1.0, 0.0)
    assert steep.noise_gain() == np.inf


@pytest.mark.parametrize("lifted", [False, True])
def test_a_memory_that_learns_too_fast_is_unstable(lifted: bool) -> None:
    """q = 1 and a gain of 3 on a plant of 1 / z: the factor exceeds 1 at every frequency."""
    made = loop(WITH_MEMORY, memories=(repetitive(40, 1.0, 3.0, lifted),))
    assert made.learning() > 1
    assert not made.stable(1.0, 0.0)
    assert made.worst_peak_db() == np.inf


def test_the_noise_of_a_loop_with_a_memory() -> None:
    """Power of K / (1 - K G) over the frequencies, of noise that is white."""
    memory = repetitive(40, 0.5, 0.2)
    made = loop(WITH_MEMORY, memories=(memory,))
    w = made._angles
    K, G = -(P + memory.response(w)), 0.7 * np.exp(-1j * w)
    power = np.abs(K / (1 - K * G)) ** 2
    area = ((power[1:] + power[:-1]) / 2 * np.diff(w)).sum()
    assert made.noise_gain(0.7) == pytest.approx(np.sqrt(area / np.pi), rel=1e-9)


# ---- small parts ---------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("n", [0, 1, 2, -3])
def test_turns_around_zero(n: int) -> None:
    w = np.linspace(0, np.pi, 1001)[1:]
    assert _turns(np.exp(1j * n * w)) == n
    assert _turns(2 + np.exp(1j * n * w)) == 0


def test_what_lies_behind_a_unit() -> None:
    edges = [(0, 1), (1, 2), (2, 1), (3, 0), (4, 4)]
    assert behind(edges, 0) == {1, 2}
    assert behind(edges, 1) == {1, 2}
    assert behind(edges, 4) == {4}
    assert behind(edges, 2) == {1, 2}
    assert behind([], 0) == set()


def test_equal_loops_have_equal_keys() -> None:
    one, other = loop(integrator(30.0)), loop(integrator(30.0))
    assert one.key == other.key
    memory = repetitive(40, 0.9, 0.5)
    changed = [
        replace(one, h=0.02),
        replace(one, hysteresis=("a", "c")),
        replace(one, side=PlantSide((), 1.0)),
        replace(one, at="x.y"),
        replace(one, controller=integrator(31.0)),
        replace(one, plant=LAG),
        replace(one, memories=(memory,)),
        replace(one, memories=(repetitive(40, 0.9, 0.5, True),)),
    ]
    assert len({one.key, *(c.key for c in changed)}) == 9
