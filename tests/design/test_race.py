"""A race of structures, and robust controllers of shaped plants: closed forms, and loops that hold over plants."""

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_lyapunov

from hystfmu.base.errors import InputError
from hystfmu.design import loop_shaping
from hystfmu.design.delays import StateSpace, sampled
from hystfmu.design.linear import python_control
from hystfmu.design.loop import response_of
from hystfmu.design.plants import Plant, Unseen, plant_set
from hystfmu.design.race import Aim, Race, distances, race, unencircled
from hystfmu.design.structures import STRUCTURES, Design

H = 1e-4
SLOPES = (0.68, 1.64)
AIM = Aim(10.0 * np.arange(1, 30, 2), 1e-6 / np.arange(1, 30, 2) ** 2.0, 0.125 / np.arange(1, 30, 2) ** 4.0, noise=1e-4)
STAGE = Plant((700.0,), (0.02,), (1.0,))


def on_fine_steps(p: Plant, h: float, z: np.ndarray, fine: int = 4000) -> np.ndarray:
    """Return the response from an impulse response that is summed in time: no pole, no partial fraction."""
    n = 4000
    t = np.arange(1, n + 1) * h - p.delay
    step = np.zeros(n)
    for f, zeta, k in zip(p.f_n, p.zeta, p.share, strict=True):
        w, d = 2 * np.pi * f, np.sqrt(1 - zeta**2)
        late = np.maximum(t, 0)
        step += k * (1 - np.exp(-zeta * w * late) * (np.cos(w * d * late) + zeta / d * np.sin(w * d * late))) * (t > 0)
    step += p.rest * (t > 1e-12)
    pulse = np.diff(step, prepend=0.0)
    return np.asarray((pulse[None] * z[:, None] ** -np.arange(1.0, n + 1)).sum(axis=1))


def state_space(p: Plant, h: float) -> StateSpace:
    """Return A, B, C, D of the sampled plant. There are two states for each mode, then the delayed commands."""
    m = int(np.floor(p.delay / h + 1e-9))
    part = p.delay / h - m if p.delay / h - m > 1e-9 else 0.0
    past = m + 1 + (part > 0)  # a sample may depend on the commands u(k - 1) ... u(k - past)
    n = 2 * len(p.f_n)
    A, B, C = np.zeros((n + past, n + past)), np.zeros((n + past, 1)), np.zeros((1, n + past))
    B[n, 0] = 1.0
    A[n + 1 :, n:-1] = np.eye(past - 1)
    C[0, n + m] = p.rest
    for i, (f, zeta, k) in enumerate(zip(p.f_n, p.zeta, p.share, strict=True)):
        w, at = 2 * np.pi * f, slice(2 * i, 2 * i + 2)
        over = np.zeros((3, 3))
        over[:2] = [[0, w, 0], [-w, -2 * zeta * w, w]]
        whole, first, second = (expm(over * h * x) for x in (1.0, part, 1 - part))
        A[at, at] = whole[:2, :2]
        new, old = second[:2, 2], second[:2, :2] @ first[:2, 2]
        if m:
            A[at, n + m - 1] = new
        else:
            B[at, 0] = new
        if part > 0:
            A[at, n + m] = old
        C[0, 2 * i] = k
    return A, B, C, np.zeros((1, 1))


@pytest.mark.parametrize("plant", [
    Plant((700.0, 1500.0), (0.05, 0.03), (0.9, 0.06), 2.37e-4),
    Plant((300.0,), (0.7,), (1.0,)),
    Plant((), (), (), 1.5e-4),
    Plant((9000.0,), (0.05,), (1.0,), 1e-4),
])  # fmt: skip
def test_a_plant_answers_as_its_step_response(plant: Plant) -> None:
    z = np.exp(1j * np.linspace(0.01, 3.1, 60))
    found = plant.response(z, H)
    assert np.abs(found - on_fine_steps(plant, H, z)).max() < 1e-9 * np.abs(found).max()
    assert np.abs(found - response_of(state_space(plant, H), z)[:, 0, 0]).max() < 1e-12 * np.abs(found).max()


@pytest.mark.parametrize("name", list(STRUCTURES))
def test_the_response_of_a_structure_is_that_of_its_blocks(name: str) -> None:
    structure, design = STRUCTURES[name], Design(Plant((700.0, 1900.0), (0.02, 0.01), (0.9, 0.1), 1e-4), H)
    values = {k: float(np.sqrt(a * b)) for k, (a, b) in structure.bounds(design).items()}
    z = np.exp(1j * np.linspace(0.01, 3.1, 60))
    C, _ = structure.response(design, values, z)(50.0)
    from_y = response_of(sampled(structure.graph(design, values, 50.0), H), z)[:, 0, 1]
    assert np.abs(from_y + C).max() < 1e-9 * np.abs(C).max()


@pytest.mark.parametrize(("f_n", "f"), [((700.0, 900.0), 700.0), ((), 2500.0), ((6000.0,), 2500.0)])
def test_ranges_of_the_values_of_each_structure(f_n: tuple[float, ...], f: float) -> None:
    """From the lowest natural frequency, at most a quarter of the sampling rate."""
    design = Design(Plant(f_n, (0.02,) * len(f_n), (0.5,) * len(f_n)), H)
    roll_off, T = {"roll_off": (0.02 * f, 1e4)}, {"T": (0.02 * H, 2 / f)}
    notch, lag = {"width": (0.1, 1.5), "depth": (0.01, 0.7)} | roll_off, 1 / (2 * np.pi * f)
    wanted: dict[str, dict[str, tuple[float, float]]] = {
        "integral": {}, "integral_roll_off": roll_off, "pi": T | roll_off, "notch": notch, "pi_notch": T | notch,
        "irc": {"damping": (0.02, 3.0), "lag": (0.05 * lag, 5 * lag)}, "internal_model": notch,
        "ppf": {"damping": (0.02, 2.0), "f_p": (0.5 * f, 3 * f), "zeta_p": (0.05, 1.0)},
        "h_infinity": {"weight": (0.05 * f, 20 * f), "zero": (0.02 / f, 2 / f)},
    }  # fmt: skip
    assert wanted.keys() == STRUCTURES.keys()
    for name, bounds in wanted.items():
        found = STRUCTURES[name].bounds(design)
        assert {k: pytest.approx(v) for k, v in bounds.items()} == found, name


def closed_with(tuned: Race, p: Plant, slope: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the loop of the winner and a plant from state spaces: A, B from the noise of the sensor, C to y."""
    best = tuned.winner
    assert best is not None
    A, B, C, D = sampled(best.structure.graph(best.design, best.values, best.Ki), H)
    F, G, K, _ = state_space(p, H)
    B, D = B[:, 1:2] * slope, D[:, 1:2] * slope  # from y
    top = np.hstack([A, B @ K])
    M, N = np.vstack([top, np.hstack([G @ C, F + G @ D @ K])]), np.vstack([B, G @ D])
    return M, N, np.hstack([np.zeros((1, len(A))), K])


def closed(tuned: Race, p: Plant, slope: float) -> float:
    """Return the largest pole of the loop of the winner and a plant."""
    return float(np.abs(np.linalg.eigvals(closed_with(tuned, p, slope)[0])).max())


def test_noise_gain_with_a_light_mode_is_that_of_the_covariance() -> None:
    light = Plant((180.0,), (0.005,), (1.0,), H)
    plants = plant_set(light, H, (0.9, 1.1), errors=[(0.4, 2e-4, 0.01)], computing=0.0)
    found = race(plants, Design(light, H, 0), AIM, names=["integral"])
    M, N, C = closed_with(found, light, 1.0)
    assert found.winner is not None
    assert found.winner.noise_gain == pytest.approx((C @ solve_discrete_lyapunov(M, N @ N.T) @ C.T)[0, 0] ** 0.5, 0.01)


@pytest.fixture(scope="module")
def seen() -> Race:
    """Modes and delay known to a fraction of a percent, nothing above 1400 Hz."""
    unseen = Unseen(1400.0, 0.05)
    plants = plant_set(STAGE, H, SLOPES, errors=[(1.0, 0.002, 0.01)], delay_error=1e-5, unseen=unseen)
    return race(plants, Design(STAGE, H), AIM, names=["integral", "notch", "ppf", "internal_model"])


@pytest.mark.stress
def test_structures_that_know_the_resonance_are_faster_than_an_integral(seen: Race) -> None:
    bandwidth = {t.structure.name: t.bandwidth for t in seen.found}
    assert seen.winner is not None
    assert seen.winner.bandwidth > 3 * bandwidth["integral"]
    assert all(t.ms_db <= 6 and t.set_ms_db <= 12 for t in seen.found)


@pytest.mark.turn("a redesigned loop")
def test_the_winner_is_stable_on_plants_drawn_inside_the_set(seen: Race) -> None:
    rng = np.random.default_rng()
    for _ in range(8):
        f, zeta = 700 * (1 + 0.0099 * rng.uniform(-1, 1)), 0.02 * rng.uniform(0.7, 1.1)
        hidden = float(np.exp(rng.uniform(np.log(1400), np.log(15000))))
        p = Plant((f, hidden), (zeta, 0.01), (0.95, 0.05), (1 + rng.uniform(0, 1)) * H)
        for slope in (*SLOPES, 1.0):
            assert closed(seen, p, slope) < 1, (p, slope)


def test_an_unseen_resonance_leaves_a_slow_integrator_only() -> None:
    """Nothing is known above 30 Hz: the crossover stays below a hundredth of it, and no drawn resonance diverges."""
    slow = race(plant_set(Plant(), H, SLOPES, unseen=Unseen(30.0)), Design(Plant(), H), AIM, names=["integral"])
    assert slow.winner is not None
    assert slow.winner.Ki < 2 * np.pi * 30 / 100 * 1.05
    fast = race(plant_set(Plant(), H, SLOPES), Design(Plant(), H), AIM, names=["integral"])
    rng = np.random.default_rng()
    for f in np.exp(rng.uniform(np.log(30), np.log(4000), 60)):
        assert closed(slow, Plant((float(f),), (0.01,), (1.0,), H), 1.64) < 1
    assert closed(fast, Plant((300.0,), (0.01,), (1.0,), H), 1.0) > 1, "without the set the same loop diverges"


def test_the_nearest_slope_of_a_sector_is_found_in_closed_form() -> None:
    rng = np.random.default_rng()
    X = rng.normal(size=200) + 1j * rng.normal(size=200)
    k = np.linspace(*SLOPES, 2001)
    assert np.allclose(distances(X, SLOPES), np.abs(1 + k * X[:, None]).min(axis=1), atol=2e-3)
    angles = np.geomspace(1e-5, np.pi, 3000)
    z = np.exp(1j * angles)
    stable, unstable = ((0.5 * k / (z - 1) / z**2)[None] for k in (0.9, 1.9))
    assert unencircled(stable)[0]
    assert not unencircled(unstable)[0]


# ---- loop shaping ----------------------------------------------------------------------------------------------------
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
