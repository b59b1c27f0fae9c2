"""Operator blocks against independent methods: numpy, scipy solvers, closed forms, official benchmark records."""

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import curve_fit
from scipy.signal import firwin, lfilter, resample

from hystfmu.base.errors import InputError
from hystfmu.graph.blocks import (
    BacklashSum,
    BoucWen,
    BoucWenOscillator,
    PrandtlIshlinskii,
    PrandtlIshlinskiiInverse,
    Scaling,
    ZhaoTan,
)

Array = NDArray[np.float64]
RNG = np.random.default_rng(3)


def test_theorem_1_of_zhao_and_tan_has_a_counterexample() -> None:
    """Two histories end in the same (x, h) with outputs of ten plays 5.75 % of the major loop apart."""
    r = np.linspace(0.1, 1, 10) / 2
    histories = ([0, -0.6984, 0.1889, 0], [0, -0.8448, 0.5721, -0.2808, 0])
    h = [ZhaoTan()(x)[-1] for x in histories]
    y = [BacklashSum(r=r, w=np.ones(10))(x)[-1] for x in histories]
    full_scale = np.ptp(BacklashSum(r=r, w=np.ones(10))([0, 1, -1, 1]))
    assert abs(h[0] - h[1]) <= 3e-5
    assert (y[1] - y[0]) / full_scale == pytest.approx(0.0575, abs=5e-5)


# ---- Bouc-Wen -------------------------------------------------------------------------------------------------------
def test_bouc_wen_with_n_1_takes_any_step_exactly() -> None:
    """The closed form composes: one step of du is two steps of du/2."""
    u = np.cumsum(RNG.normal(size=400))
    fine = np.interp(np.arange(2 * len(u) - 1) / 2, np.arange(len(u)), u)
    block = BoucWen(beta=0.9, gamma=-0.3)
    assert np.abs(block(u)[:, 1] - block(fine)[::2, 1]).max() <= 1e-13


@pytest.mark.parametrize("n", [1.0, 1.5, 2.0, 20.0])
@pytest.mark.parametrize(("beta", "gamma"), [(0.5, 0.5), (0.0, 1.0), (1.0, -1 + 1e-9), (1e-9, 1.0), (1e100, 0.0)])
def test_bouc_wen_stays_within_its_bound_whatever_the_input(n: float, beta: float, gamma: float) -> None:
    u = np.array([0.0, 1e-300, 1.0, -1e3, 1e12, -1e300, 1e300, 0.5, -0.5])
    z = BoucWen(beta=beta, gamma=gamma, n=n)(u)[:, 1]
    bound = (1 / (beta + gamma)) ** (1 / n)
    assert (np.abs(z) <= bound * (1 + 1e-14)).all()
    saturated = [4] if beta == 0 else [4, 6]  # beta = 0: no hysteresis, the lower asymptote holds the solution
    assert np.abs(np.abs(z[saturated]) - bound).max() <= 1e-9 * bound


def test_bouc_wen_comes_to_its_first_input_from_u0() -> None:
    """As if the path from u0 were rows in front, whichever input comes first."""
    u = RNG.uniform(-1, 1, 30)
    z = BoucWen(z0=0.4)(np.concatenate([[0.0], u]))[1:, 1]
    assert np.abs(BoucWen(z0=0.4)(u)[:, 1] - z).max() <= 1e-14
    assert np.abs(BoucWen(z0=0.4, u0=7.0)(u + 7)[:, 1] - z).max() <= 1e-14
    assert BoucWen(z0=0.4, u0=u[0])(u)[0, 1] == 0.4


# ---- Bouc-Wen oscillator --------------------------------------------------------------------------------------------
PLANT = {"m_L": 2.0, "c_L": 10.0, "k_L": 5e4, "alpha": 5e4, "beta": 1e3, "gamma": 0.8, "delta": -1.1}


def oscillator_by_scipy(t: Array, nu: float) -> Array:
    def f(time: float, x: Array) -> Array:
        y, v, z = x
        u = 60 * math.sin(2 * math.pi * 25 * time)
        flow = PLANT["gamma"] * abs(v) * abs(z) ** (nu - 1) * z + PLANT["delta"] * v * abs(z) ** nu
        a = (u - PLANT["c_L"] * v - PLANT["k_L"] * y - z) / PLANT["m_L"]
        return np.array([v, a, PLANT["alpha"] * v - PLANT["beta"] * flow])

    solved = solve_ivp(f, (0, t[-1]), np.zeros(3), "Radau", t_eval=t, rtol=1e-8, atol=1e-12, max_step=2e-4)
    return solved.y[[0, 2]].T


@pytest.mark.turn("blocks and other integrators")
@pytest.mark.some(1)
@pytest.mark.parametrize("nu", [1.0, 1.2])
def test_oscillator_converges_to_its_differential_equation(nu: float) -> None:
    """Order 2 against an implicit Runge-Kutta method of order 5 with error control."""
    t = np.arange(101) * 1e-3
    expected = oscillator_by_scipy(t, nu)
    errors = []
    for m in (10, 20):
        fine = np.arange(100 * m + 1) * (1e-3 / m)
        y = BoucWenOscillator(nu=nu)(60 * np.sin(2 * np.pi * 25 * fine), h=1e-3 / m)[::m]
        errors.append(np.abs(y - expected).max(axis=0) / np.abs(expected).max(axis=0))
    assert (errors[1] <= 1.5e-4).all()
    assert (errors[1] <= 0.3 * errors[0]).all()


def test_oscillator_has_the_published_linear_mode() -> None:
    """Noel & Schoukens 2016: at low amplitude 35.59 Hz and 1.12 % damping."""
    t = np.arange(6000) * 5e-5
    u = np.zeros(6000)
    u[0] = 1e-9
    y = BoucWenOscillator()(u, h=5e-5)[:, 0]

    def mode(t: Array, f: float, zeta: float, a: float, phase: float) -> Array:
        return a * np.exp(-2 * np.pi * f * zeta * t) * np.sin(2 * np.pi * f * math.sqrt(1 - zeta**2) * t + phase)

    scale = np.abs(y).max()
    (f, zeta, *_), _ = curve_fit(mode, t[10:], y[10:] / scale, [35.0, 0.01, 1.0, 0.0])
    assert round(f, 2) == 35.59
    assert round(100 * zeta, 2) == 1.12


def test_a_long_step_is_divided() -> None:
    """One step of 10 ms equals its internal steps with a linear force."""
    omega = math.sqrt(1e5 / 2)
    m = 1 + math.floor(2 * 0.01 * omega)
    u = np.array([0.0, 50.0, -30.0, 20.0])
    fine = np.interp(np.arange(3 * m + 1) / m, np.arange(4), u)
    assert np.abs(BoucWenOscillator()(u, h=0.01) - BoucWenOscillator()(fine, h=0.01 / m)[::m]).max() <= 1e-12


def decimate(y: Array, factor: int) -> Array:
    """Zero-phase FIR decimation of the benchmark: 30 taps, ends continued by point reflection."""
    taps, b = 30, firwin(31, 1 / factor, window="hamming")
    begin, end = 2 * y[0] - y[taps:0:-1], 2 * y[-1] - y[-2 : -(2 * taps + 2) : -1]
    return lfilter(b, 1, np.concatenate([begin, y, end]))[taps + taps // 2 :][: y.size : factor]


@pytest.fixture(scope="module")
def records(measured: Path) -> dict[str, Array]:
    h5py = pytest.importorskip("h5py")
    path = measured / "boucwen_benchmark" / "test.h5"
    if not path.exists():
        pytest.skip(f"official benchmark records not found: {path}")
    with h5py.File(path) as f:
        return {f"{s}/{c}": np.array(f[f"{s}/{c}"]).ravel() for s in ("multisine", "sinesweep") for c in "uy"}


def test_oscillator_reproduces_the_official_multisine_record(records: dict[str, Array]) -> None:
    u, y = records["multisine/u"], records["multisine/y"]
    simulated = BoucWenOscillator()(np.tile(resample(u, 20 * u.size), 3), h=1 / 15000)[:, 0]
    for factor in (2, 2, 5):
        simulated = decimate(simulated, factor)
    error = simulated[u.size : 2 * u.size] - y
    assert np.sqrt(np.mean(error**2)) <= 2e-15  # metres; rms of the record 6.7e-4


@pytest.mark.turn("blocks and other integrators")
def test_oscillator_reproduces_the_official_sweep_record(records: dict[str, Array]) -> None:
    y = records["sinesweep/y"]
    t = np.arange(20 * y.size) / 15000
    u = 40 * np.sin(2 * np.pi * (18 * t + t**2 / 12))
    simulated = decimate(BoucWenOscillator()(u, h=1 / 15000)[:, 0], 20)
    assert np.sqrt(np.mean((simulated[: y.size] - y) ** 2)) <= 2e-15


# ---- parameters that do not fit together ----------------------------------------------------------------------------
@pytest.mark.parametrize(("block", "values", "sentence"), [
    (PrandtlIshlinskii, {"r": [0.2, 0.1], "w": [1, 1]}, "thresholds r must not decrease"),
    (PrandtlIshlinskiiInverse, {"r": [0.2, 0.1], "w": [1, 1]}, "thresholds r must not decrease"),
    (PrandtlIshlinskiiInverse, {"w0": 0.0, "r": [0.1], "w": [1]}, r"'w0' .* must be a float in \(0, inf\)"),
    (PrandtlIshlinskiiInverse, {"r": [0.1, 0.2], "w": [-1, 2]}, "so that the loading curve increases"),
    (PrandtlIshlinskiiInverse, {"r": [0.1, 0.2], "w": [1, -2]}, "so that the loading curve increases"),
    (BoucWen, {"beta": 0.5, "gamma": -0.5}, r"beta \+ gamma must be greater than 0"),
    (BoucWen, {"z0": 1.001}, r"z0\| must be at most \(A / \(beta \+ gamma\)\)\^\(1/n\)"),
    (Scaling, {"lo": 1.0, "hi": 0.5}, "lo must not be greater than hi"),
])  # fmt: skip
def test_parameters_that_do_not_fit_together_are_refused(block: type, values: dict[str, object], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        block(**values)([0.0, 1.0])


def test_weights_between_equal_thresholds_may_cancel() -> None:
    values = {"w0": 1.0, "r": [0.1, 0.1, 0.3], "w": [-2.0, 3.0, -1.5]}
    y = RNG.uniform(-1, 1, 200)
    assert np.abs(PrandtlIshlinskii(**values)(PrandtlIshlinskiiInverse(**values)(y)) - y).max() <= 1e-14


def test_a_step_of_thousands_of_periods_is_refused() -> None:
    with pytest.raises(InputError, match="the step is too long"):
        BoucWenOscillator()([0.0, 1.0], h=100.0)
