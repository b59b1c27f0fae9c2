"""Plain numpy forms of the controllers against the committed references of their Validation models.

That the models give the references is tested elsewhere: no simulation here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import library
import numpy as np
import outcome
import pytest
import scipy.linalg
import scipy.ndimage
import scipy.signal

Array = outcome.Array
Values = dict[str, Any]


def around_limits(u_min: float, u_max: float, before: float, step: float) -> float:
    """A step of an integral, in units of the output: 0 if it leads further out of the limits."""
    outwards = (before + step > u_max and step > 0) or (before + step < u_min and step < 0)
    return 0.0 if outwards else step


def super_twisting(t: Array, v: Values) -> Array:
    h, e = v["Ts"], 0.9 * np.sin(20 * t - 0.1) + 0.05 - np.sin(20 * t)
    # backward differences through the lag tau
    de = scipy.signal.lfilter([1 / (v["tau"] + h)], [1, -v["tau"] / (v["tau"] + h)], np.diff(e, prepend=e[0]))
    s = de + v["lam"] * e
    size = np.abs(s) + v["epsilon"]
    root, linear = s / np.sqrt(size), v["mu"] * s
    rate = s / size / 2 + 1.5 * v["mu"] * root + v["mu"] * linear
    free = 1.1 * np.sin(20 * t) - v["k_1"] * (root + linear)
    integral = np.zeros(len(t))
    for k in range(1, len(t)):
        step = -v["k_2"] * rate[k] * h
        integral[k] = integral[k - 1] + around_limits(v["u_min"], v["u_max"], free[k] + integral[k - 1], step)
    return np.column_stack([np.clip(free + integral, v["u_min"], v["u_max"]), s])


def lead_lag(t: Array, v: Values) -> Array:
    e = np.sin(20 * t) - (0.9 * np.sin(20 * t - 0.1) + 0.05)
    for T_z, T_p in zip(v["T_z"], v["T_p"], strict=True):
        b, a = scipy.signal.bilinear([T_z, 1], [T_p, 1], 1 / v["Ts"])
        e = scipy.signal.lfilter(b, a, e, zi=scipy.signal.lfilter_zi(b, a) * e[0])[0]
    return np.clip(1.1 * np.sin(20 * t) + v["K"] * e, v["u_min"], v["u_max"])[:, None]


def iterative_learning(t: Array, v: Values) -> Array:
    n, x = v["n"], 62.83185307179586 * t
    e = np.sin(x) - (0.9 * np.sin(x - 0.1) + 0.05)
    w = np.zeros(len(t))
    for k in range(n, len(t), n):
        learnt = w[k - n : k] + v["gain"] * np.roll(e[k - n : k], -v["lead"])
        filtered = scipy.ndimage.convolve1d(learnt, [v["smooth"], 1 - 2 * v["smooth"], v["smooth"]], mode="wrap")
        w[k : k + n] = filtered[: len(t) - k]
    return np.clip(1.1 * np.sin(x) + w, v["u_min"], v["u_max"])[:, None]


def disturbance_observer(t: Array, v: Values) -> Array:
    h, omega, gain = v["Ts"], 2 * np.pi * v["f_n"], v["gain"]
    # position, velocity, disturbance; the command is held
    A = np.array([[0, 1, 0, 0], [-(omega**2), -2 * v["zeta"] * omega, gain * omega**2, gain * omega**2]])
    over = scipy.linalg.expm(h * np.vstack([A, np.zeros((2, 4))]))
    F, g, z = over[:3, :3], over[:3, 3], np.exp(-2 * np.pi * v["f_o"] * h)
    seen = np.array([np.linalg.matrix_power(F, k)[0] for k in (1, 2, 3)])
    M = np.linalg.matrix_power(F - z * np.eye(3), 3) @ np.linalg.solve(seen, [0.0, 0.0, 1.0])
    assert np.linalg.eigvals(F - np.outer(M, F[0])) == pytest.approx(np.full(3, z), abs=1e-4)  # a triple one
    y = 1.2 * np.sin(20 * t - 0.1) + 0.05
    x, found = np.array([y[0], 0, 0]), np.empty((len(t), 2))
    for k, measured in enumerate(y):
        if k > 0:
            x = F @ x + g * found[k - 1, 0]
            x += M * (measured - x[0])
        found[k] = np.clip(np.sin(20 * t[k]) - x[2], v["u_min"], v["u_max"]), x[2]
    return found


FORMS: dict[str, Callable[[Array, Values], Array]] = {
    "SuperTwisting": super_twisting,
    "LeadLag": lead_lag,
    "IterativeLearning": iterative_learning,
    "DisturbanceObserver": disturbance_observer,
}


@pytest.mark.parametrize("name", FORMS)
def test_reference_agrees_with_the_plain_form(name: str) -> None:
    model = f"HystFMU.Validation.{name}"
    tested = library.classes()[model].tree.symbols["tested"]
    v = {k: library.evaluate(e, {}) for k, e in library.modifiers(tested.class_modification).items()}
    table = np.loadtxt(outcome.reference_file(model), delimiter=",", skiprows=1)
    rows = np.rint(table[:, 0] / v["Ts"]).astype(int)
    expected = FORMS[name](v["Ts"] * np.arange(rows[-1] + 1), v)[rows]
    assert len(rows) > 80
    limited = np.isin(expected[:, 0], [v["u_min"], v["u_max"]])
    assert 0.05 < np.mean(limited) < 0.8, "both with and without the limits"
    # 12 digits in the file
    assert outcome.relative(table[:, 1:], expected) <= 5e-12
