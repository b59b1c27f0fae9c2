"""An opened loop made by hand: response, poles, margins and noise against closed forms; its rows in a table."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hystfmu.design.repetitive import PeriodMemory
from hystfmu.scenario.loop import table as module
from hystfmu.scenario.loop.opened import OpenedLoop
from hystfmu.scenario.loop.opening import LoopVerdict
from hystfmu.scenario.loop.plant import PlantSide, held
from hystfmu.scenario.loop.table import COLUMNS, FALLING, LoopRow, MarginTable

H = 0.01
TAU = 0.05
GAIN = np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.ones((1, 1))  # a plant without states


def integrator(k: float, *more: Any) -> Any:
    """u = -k h sum y."""
    return np.ones((1, 1)), np.array([[-k * H]]), np.ones((1, 1)), np.array([[-k * H]])


def loop(controller: Any, plant: Any = GAIN, delay: float = 0.0, **more: Any) -> OpenedLoop:
    return OpenedLoop(None, controller, plant, H, (0.5, 2.0), ("a", "b"), PlantSide((), delay), **more)  # type: ignore[arg-type]


# ---- what comes late ------------------------------------------------------------------------------------------------


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


def test_the_delays_up_to_which_it_is_stable() -> None:
    """z^2 - z + a is stable below a = 1; z^3 - z^2 + a below a = 0.618; a is at most twice the gain."""
    assert loop(integrator(45.0)).stable_to((0.0, 1.0, 2.0)) == 1.0
    assert loop(integrator(45.0)).stable_to((2.0, 1.0, 0.0)) == 1.0, "in any order"
    assert loop(integrator(30.0)).stable_to((0.0, 1.0, 2.0)) == 2.0
    assert loop(integrator(80.0)).stable_to((0.0, 1.0)) == 0.0
    assert np.isnan(loop(integrator(120.0)).stable_to((0.0, 1.0)))
    assert loop(integrator(45.0)).stable_at(1.0)
    assert not loop(integrator(45.0)).stable_at(2.0)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_plant_that_falls_with_its_command_has_the_row_of_its_mirror_image(sign: int) -> None:
    """The sector reaches 0, and the largest gain is the one of the largest modulus: here z^2 - z + 0.6."""
    made = loop(integrator(30.0 * sign))
    named = SimpleNamespace(case=SimpleNamespace(scenario="s", name="a"))
    made = replace(made, system=named, slopes=tuple(sorted((0.0, 2.0 * sign))))  # type: ignore[arg-type]
    made.__dict__["nominal"] = 1.0 * sign
    found = module._row([made], False)
    assert found.margins["stable_to_steps"] == 2.0
    z = np.exp(1j * np.linspace(1e-3, np.pi, 100_000))
    expected = -20 * np.log10(np.abs(1 + 0.6 / (z - 1) / z).min())
    assert found.margins["Ms_1_largest_db"] == pytest.approx(expected, abs=1e-3)


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
        assert made.response_at(made._angles[::40], slope) == pytest.approx(want[::40], rel=1e-9)
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
    slow = loop(WITH_MEMORY, LAG2, memories=(memory,))
    assert slow.learning() == slow.learning(1.0, 0.0) != slow.learning(1.0, 2.0)
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


def test_the_noise_of_a_loop_with_a_memory() -> None:
    """Power of K / (1 - K G) over the frequencies, of noise that is white."""
    memory = repetitive(40, 0.5, 0.2)
    made = loop(WITH_MEMORY, memories=(memory,))
    w = made._angles
    K, G = -(P + memory.response(w)), 0.7 * np.exp(-1j * w)
    power = np.abs(K / (1 - K * G)) ** 2
    area = ((power[1:] + power[:-1]) / 2 * np.diff(w)).sum()
    assert made.noise_gain(0.7) == pytest.approx(np.sqrt(area / np.pi), rel=1e-9)


# ---- rows ------------------------------------------------------------------------------------------------------------
LINEAR = dict.fromkeys(COLUMNS, 1.5) | {
    "simulated_delay_steps": None, "learning": None, "stable": True, "conditionally_stable": False,
}  # fmt: skip


def row(
    scenario: str = "s", cases: tuple[str, ...] = ("a",), at: tuple[dict[str, Any], ...] = (), **more: Any
) -> LoopRow:
    return LoopRow(scenario, cases, (0.5, 1.25), LINEAR | more, at)


def cells(line: str) -> list[str]:
    return line.split()


def test_a_row_of_a_loop() -> None:
    columns = ["Ms_db", "gain_db", "simulated_delay_steps", "learning"]
    assert row(gain_low_db=-math.inf).cells(["gain_low_db"])[3] == "-inf"
    assert row().cells(columns) == ["s", "a", "0.50..1.25", "1.5", "1.5", "", ""]
    assert row(Ms_db=None).cells(columns)[3] == "unstable"
    assert row(simulated_delay_steps=4).cells(columns)[5] == ">= 4"
    assert row(simulated_delay_steps=3.75).cells(columns)[5] == "3.75"
    assert row(simulated_delay_steps=4).cells(["Ms_db"]) == ["s", "a", "0.50..1.25", "1.5"]
    assert row(Ms_db=-0.0).cells(["Ms_db"])[3] == "0"
    assert row(cases=("a", "b")).cells([])[1] == "a, b"
    assert row(cases=("a", "b", "c")).cells([])[1] == "a, b and 1 more"


def test_columns_that_no_loop_has_are_left_out() -> None:
    plain, falling = row(), row(simulated_delay_steps=2.0)
    head = MarginTable([plain], [], []).text().splitlines()[0]
    assert "simulated" not in head
    assert "learning" not in head
    both = MarginTable([plain, falling], [], []).text()
    assert "delay steps, simulated" in both.splitlines()[0]
    assert both.endswith(FALLING)
    assert FALLING not in MarginTable([plain], [], []).text()
    at = ({"further_steps": 0.0, "sector_stable": True} | dict.fromkeys(module.AT_DELAY, 1.0),)
    late = MarginTable([row(at=at), row(at=at, learning=0.5)], [], []).text(delays=True)
    assert "learning factor" in late.splitlines()[0]
    assert "learning" not in MarginTable([row(at=at)], [], []).text(delays=True)
    assert "further steps" in late.splitlines()[0]
    assert "further steps" not in both


def verdict(value: float | None, bound: float = 2.0, at_least: bool = False) -> LoopVerdict:
    return LoopVerdict("s", "Ms_db", "a", value, bound, at_least)


def test_reasons_are_counted_by_scenario() -> None:
    refused = ["s/a: no feedback", "s/b: no feedback", "s/c: other", "r/a: no feedback"]
    lines = MarginTable([], refused, [verdict(9.0)]).text().splitlines()
    assert lines[-4:] == [
        "no margins: s, 2 cases: no feedback",
        "no margins: s, 1 case: other",
        "no margins: r, 1 case: no feedback",
        verdict(9.0).line(),
    ]
    assert str(MarginTable([], refused, [])) == "\n".join(lines[-4:-1])


def test_for_machines_infinity_is_none() -> None:
    at = ({"further_steps": 0.0, "gain_db": math.inf},)
    found = MarginTable(
        [row(at=at, gain_db=math.inf, gain_low_db=-math.inf, phase_deg=-math.inf)], ["s/a: x"], [verdict(1.0)]
    ).summary()
    (loop,) = found["loops"]
    m = loop["margins"]
    assert (m["gain_db"], m["gain_low_db"], m["phase_deg"], m["Ms_db"]) == (None, None, None, 1.5)
    assert loop["at_delay"] == [{"further_steps": 0.0, "gain_db": None}]
    assert found["refused"] == ["s/a: x"]
    assert found["verdicts"][0] == vars(verdict(1.0)) | {"within": True}
