"""Oscillator with a Duhem force of any shape: block and kind of model, against scipy's integration of a plant."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hystfmu import Dataset, Graph, InputError, Node
from hystfmu.identify import auto, fit
from hystfmu.identify.catalogue import candidates
from hystfmu.identify.methods.duhem_oscillator import physical

H = 1e-3
PLANT = (2.0, 15.0, 3e4)  # kg, N s/m, N/m


def bouc_wen_law(x):
    """dz/dy of z' = 4e4 y' - 900 |y'| z + 400 y' |z| seen along the motion: linear on either side of 0."""
    return 4e4 - 900 * x + 400 * np.abs(x)


def friction_law(x):
    """dz/dy of a Dahl force with a cubic knee, which is no Bouc-Wen force; it yields at 60 N."""
    return 4e4 * (1 - x / 60) ** 3


def displacement(u, law, h=H):
    """By scipy's adaptive RK45, not the Verlet rule of the core; u runs linearly between rows."""
    t = h * np.arange(len(u))
    m, c, k = PLANT

    def rate(at, x):
        q, v, z = x
        return [v, (np.interp(at, t, u) - c * v - k * q - z) / m, v * law(np.sign(v) * z)]

    return solve_ivp(rate, (0, t[-1]), np.zeros(3), t_eval=t, rtol=1e-7, atol=1e-9, max_step=h).y[0]


def force(seed, rows=1000, rms=60.0):
    """Random phases, 5 to 60 Hz; the resonance is at 30 Hz."""
    spectrum = np.zeros(rows // 2 + 1, complex)
    spectrum[5 * rows // 1000 : 60 * rows // 1000] = 1
    u = np.fft.irfft(spectrum * np.exp(2j * np.pi * np.random.default_rng(seed).uniform(size=len(spectrum))), rows)
    return u * rms / u.std()


def test_the_law_of_bouc_wen_is_two_lines():
    u = force(1)[:200]
    expected = displacement(u, bouc_wen_law)
    x = np.array([-500.0, 0.0, 500.0])
    m, c, k = PLANT
    node = Node("b", "duhem_oscillator", {}, {"m_L": m, "c_L": c, "k_L": k, "f": bouc_wen_law(x), "z_max": 500.0})
    errors = []
    for finer in (4, 8):
        fine = np.interp(np.arange((len(u) - 1) * finer + 1) / finer, np.arange(len(u)), u)
        y = Graph.single(node).run(fine, H / finer)[::finer, 0]
        errors.append(np.abs(y - expected).max() / np.abs(expected).max())
    assert errors[1] <= 1e-3
    assert errors[1] <= 0.35 * errors[0]  # order 2


@pytest.mark.turn("oscillators")
@pytest.mark.some(1)
@pytest.mark.parametrize(("law", "limit"), [(bouc_wen_law, 0.8), (friction_law, 0.8)])
def test_a_plant_of_another_integrator_on_other_signals(law, limit):
    """% of the span, from 1 s of data; the target for actuators with dynamics is 0.1 % from 3 s."""
    model = fit(Dataset.from_signal(u := force(2), displacement(u, law), H), "duhem_oscillator")
    seed = int(np.random.SeedSequence().generate_state(1)[0])
    for seen in (force(seed), 0.5 * force(seed + 1)):
        y = displacement(seen, law)
        error = 100 * np.sqrt(np.mean((model.predict(seen) - y) ** 2)) / np.ptp(y)
        assert error <= limit, f"seed {seed}: {error:.3g} %"


def work(p, seed):
    """Return the work of a random force over time, from rest."""
    values = {"m_L": p[0], "c_L": p[1], "k_L": p[2], "f": p[3:], "z_max": 1.0}
    graph = Graph.single(Node("b", "duhem_oscillator", {}, values))
    h = 0.01 / np.sqrt((p[2] + np.abs(p[3:]).max()) / p[0])
    levels = np.random.default_rng(seed).normal(size=41)
    u = np.interp(np.arange(40 * 500) / 500, np.arange(41), levels)
    y = graph.run(u, h)[:, 0]
    return np.cumsum(0.5 * (u[1:] + u[:-1]) * np.diff(y))


def test_the_force_of_every_fit_takes_energy():
    """A passive force: a model at rest has no work to give, whatever the search tried."""
    seed = int(np.random.SeedSequence().generate_state(1)[0])
    rng = np.random.default_rng(seed)
    for n in (3, 5, 17):
        p = physical(2 * rng.normal(size=3 + n))
        p[1] = 0.0
        done = work(p, seed)
        assert done.min() >= -1e-4 * done.max(), seed
    done = work(np.array([1.0, 0.0, 0.1, 0.1, 2.0]), 0)  # softer where it unloads: it drives the motion
    assert done.min() < -0.1 * done.max()


@pytest.mark.stress
def test_auto_takes_it_for_an_oscillator(monkeypatch):
    found = candidates()
    few = ("prandtl_ishlinskii", "polynomial_narx", "duhem_oscillator")
    monkeypatch.setattr(auto, "candidates", lambda: {key: found[key] for key in few})
    data = Dataset.from_signal(u := force(4), displacement(u, friction_law), H)
    assert fit(data, "auto").key == "duhem_oscillator"


def test_a_record_without_an_oscillator_is_refused_before_the_search():
    """A stack around its bias: a search from rest would wander among stiff oscillators for minutes."""
    u = 100.0 + force(5)
    y = displacement(force(5), bouc_wen_law)
    with pytest.raises(InputError, match=r"below that of the output 0\. Got [1-9]"):
        fit(Dataset(H * np.arange(len(u)), u, y), "duhem_oscillator")
