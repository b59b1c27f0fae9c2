"""Plain numpy forms of the controllers, for the recorded inputs of a Validation model: every output, every row."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import scipy.ndimage
import scipy.signal
from numpy.typing import NDArray

Array = NDArray[np.float64]
Values = dict[str, Any]


def around_limits(u_min: float, u_max: float, before: float, step: float) -> float:
    """A step of an integral, in units of the output: 0 if it leads further out of the limits."""
    outwards = (before + step > u_max and step > 0) or (before + step < u_min and step < 0)
    return 0.0 if outwards else step


def super_twisting(u: Array, v: Values, h: float) -> Array:
    y_d, y, u_ff = u.T
    e = y - y_d
    # backward differences through the lag tau
    de = scipy.signal.lfilter([1 / (v["tau"] + h)], [1, -v["tau"] / (v["tau"] + h)], np.diff(e, prepend=e[0]))
    s = de + v["lam"] * e
    size = np.abs(s) + v["epsilon"]
    root, linear = s / np.sqrt(size), v["mu"] * s
    rate = s / size / 2 + 1.5 * v["mu"] * root + v["mu"] * linear
    free = u_ff - v["k_1"] * (root + linear)
    integral = np.zeros(len(u))
    for k in range(1, len(u)):
        step = -v["k_2"] * rate[k] * h
        integral[k] = integral[k - 1] + around_limits(v["u_min"], v["u_max"], free[k] + integral[k - 1], step)
    return np.column_stack([np.clip(free + integral, v["u_min"], v["u_max"]), s])


def lead_lag(u: Array, v: Values, h: float) -> Array:
    y_d, y, u_ff = u.T
    e = y_d - y
    for T_z, T_p in zip(v["T_z"], v["T_p"], strict=True):
        b, a = scipy.signal.bilinear([T_z, 1], [T_p, 1], 1 / h)
        e = scipy.signal.lfilter(b, a, e, zi=scipy.signal.lfilter_zi(b, a) * e[0])[0]
    return np.clip(u_ff + v["K"] * e, v["u_min"], v["u_max"])[:, None]


def iterative_learning(u: Array, v: Values, h: float) -> Array:
    y_d, y, u_ff = u.T
    n, e = v["n"], y_d - y
    w = np.zeros(len(u))
    for k in range(n, len(u), n):
        learnt = w[k - n : k] + v["gain"] * np.roll(e[k - n : k], -v["lead"])
        filtered = scipy.ndimage.convolve1d(learnt, [v["smooth"], 1 - 2 * v["smooth"], v["smooth"]], mode="wrap")
        w[k : k + n] = filtered[: len(u) - k]
    return np.clip(u_ff + w, v["u_min"], v["u_max"])[:, None]


def repetitive(u: Array, v: Values, h: float) -> Array:
    y_d, y, active = u.T
    n, n_q, n_l = v["n"], v["n_q"], v["n_l"]
    before = n + n_q + n_l  # zeros before the first step
    zero_phase = np.concatenate([v["q"][:0:-1], v["q"]])
    e = np.concatenate([np.zeros(before), np.where(active > 0, y_d - y, 0.0)])
    w = np.zeros_like(e)
    for k in range(before, len(w)):
        w[k] = zero_phase @ w[k - n - n_q : k - n + n_q + 1] + v["l"] @ e[k - n - n_l : k - n + n_l + 1]
    return (y_d + w[before:])[:, None]


def disturbance_observer(u: Array, v: Values, h: float) -> Array:
    command, y = u.T
    omega, gain = 2 * np.pi * v["f_n"], v["gain"]
    # position, velocity, disturbance; the command is held
    A = np.array([[0, 1, 0, 0], [-(omega**2), -2 * v["zeta"] * omega, gain * omega**2, gain * omega**2]])
    over = scipy.linalg.expm(h * np.vstack([A, np.zeros((2, 4))]))
    F, g, z = over[:3, :3], over[:3, 3], np.exp(-2 * np.pi * v["f_o"] * h)
    seen = np.array([np.linalg.matrix_power(F, k)[0] for k in (1, 2, 3)])
    M = np.linalg.matrix_power(F - z * np.eye(3), 3) @ np.linalg.solve(seen, [0.0, 0.0, 1.0])
    assert np.linalg.eigvals(F - np.outer(M, F[0])) == pytest.approx(np.full(3, z), abs=1e-4)  # a triple pole
    x, found = np.array([y[0], 0, 0]), np.empty((len(u), 2))
    for k, measured in enumerate(y):
        if k > 0:
            x = F @ x + g * (found[k - v["n"], 0] if k >= v["n"] else 0.0)
            x += M * (measured - x[0])
        found[k] = np.clip(command[k] - x[2], v["u_min"], v["u_max"]), x[2]
    return found


FORMS: dict[str, Callable[[Array, Values, float], Array]] = {
    "SuperTwisting": super_twisting,
    "LeadLag": lead_lag,
    "IterativeLearning": iterative_learning,
    "Repetitive": repetitive,
    "DisturbanceObserver": disturbance_observer,
}


def outputs(block: str, u: Array, v: Values, h: float) -> Array:
    """Outputs of the class `block`, which are at their limits, if it has some, for a part of the rows."""
    found = FORMS[block](u, v, h)
    if "u_min" not in v:
        return found
    limited = np.isin(found[:, 0], [v["u_min"], v["u_max"]])
    assert 0.05 < np.mean(limited) < 0.8, "both with and without the limits"
    return found
