"""Reference plants for the tests of identification, in numpy, independent of the package."""

from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

rng = np.random.default_rng(5)
R = np.sort(rng.uniform(0.05, 0.5, 10))  # on no grid of any method
W = rng.uniform(0.5, 1.5, 10)
W0 = 3.0


def plays(u, r, z=0.0):
    """Play operators p_r[u], row by row from their definition."""
    state, out = np.full(len(r), z), np.empty((len(u), len(r)))
    for k, value in enumerate(u):
        state = np.maximum(value - r, np.minimum(value + r, state))
        out[k] = state
    return out


def prandtl_ishlinskii(u):
    """Ten plays and a linear term."""
    return W0 * u + plays(u, R) @ W


def asymmetric(u):
    """The same with a bent readout."""
    z = prandtl_ishlinskii(u) / 8
    return z + 0.15 * z**2 - 0.1 * z**3


def drifting(u, T, load):
    """The same with gain and bend that drift with the temperature (degC), and an offset that follows the load (N)."""
    z, warm = prandtl_ishlinskii(u) / 8, (T - 40) / 20
    return (1 + 0.15 * warm) * (z + 0.15 * (1 + 0.5 * warm) * z**2 - 0.1 * z**3) + 0.05 * load


def bouc_wen(u, A=1.3, beta=1.1, gamma=0.6, n=1.4, a=0.35, b=0.9, c=0.2):
    """c + a u + b z with dz/du = A - (beta sgn(du z) + gamma) |z|^n, by scipy's RK45 along every ramp."""
    turns = [0, *(np.flatnonzero(np.diff(np.sign(np.diff(u))) != 0) + 1).tolist(), len(u) - 1]
    z = np.zeros(len(u))
    for i, j in pairwise(turns):
        s = np.sign(u[j] - u[i])
        path = np.abs(u[i : j + 1] - u[i])
        flow = lambda x, v, s=s: s * (A - (beta * np.sign(s * v) + gamma) * np.abs(v) ** n)  # noqa: E731
        z[i : j + 1] = solve_ivp(flow, (0, path[-1]), [z[i]], t_eval=path, rtol=1e-9, atol=1e-11).y[0]
    return c + a * u + b * z


def bouc_wen_oscillator(u, h, m=2.0, c=15.0, k=3e4, alpha=4e4, gamma=900.0, delta=-400.0):
    """Displacement by scipy's adaptive RK45 (an integrator other than that of the core), u a line between rows."""
    t = h * np.arange(len(u))

    def rate(at, x):
        q, v, z = x
        a = (np.interp(at, t, u) - c * v - k * q - z) / m
        return [v, a, alpha * v - gamma * abs(v) * z - delta * v * abs(z)]

    return solve_ivp(rate, (0, t[-1]), [0.0, 0.0, 0.0], t_eval=t, rtol=1e-7, atol=1e-9, max_step=2 * h).y[0]
