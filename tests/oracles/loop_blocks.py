"""Blocks of the closed loops in numpy and scipy, from the equations of their papers and not from the C files.

A block is a function `(p, state, u, t, dt) -> (outputs, state)` without memory of its own: `p` holds its parameters and
sizes, `u` its inputs at the end of a step of length dt (s), over which they were held; dt = 0 at the start, where
`state` is None.  So a root can be sought on any block by trial.
"""

from functools import lru_cache, partial
from itertools import combinations_with_replacement, pairwise
from types import SimpleNamespace

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.signal import cont2discrete
from whole_history import dominant_extrema


# ---- functions -----------------------------------------------------------------------------------------------------
def weighted_sum(p, state, u, t, dt):
    return {"y": float(p.k @ u["u"] + p.offset)}, state


def scaling(p, state, u, t, dt):
    return {"y": np.minimum(np.maximum(u["u"], p.lo), p.hi) * p.gain + p.offset}, state


def product(p, state, u, t, dt):
    over = u["u"][p.n :]
    over = np.where(np.abs(over) < p.least, np.where(over < 0, -p.least, p.least), over)
    return {"y": float(np.prod(u["u"][: p.n]) / np.prod(over))}, state


def in_range(p, state, u, t, dt):
    return {"y": float(np.all((p.lo <= u["u"]) & (u["u"] <= p.hi)))}, state


def feedforward(p, state, u, t, dt):
    """The inverse of gain / (s^2 / w^2 + 2 zeta s / w + 1)."""
    w = 2 * np.pi * p.f_n
    return {"v": (u["r"] + 2 * p.zeta * u["dr"] / w + u["ddr"] / w**2) / p.gain}, state


def mlp(p, state, u, t, dt):
    shape = {0: lambda a: 1 / (1 + np.exp(-a)), 1: np.tanh, 2: lambda a: np.maximum(a, 0)}[int(p.activation)]
    hidden = shape(p.W1.reshape(p.n_hidden, p.n_in) @ u["u"] + p.b1)
    return {"y": p.W2.reshape(p.n_out, p.n_hidden) @ hidden + p.b2}, state


def quantiser(p, state, u, t, dt):
    return {"y": p.offset + p.q * np.floor((u["u"] - p.offset) / p.q + 0.5)}, state


# ---- hysteresis ----------------------------------------------------------------------------------------------------
def _plays(p, state, u):
    return np.maximum(u - p.r, np.minimum(u + p.r, state))


def play_sum(p, state, u, t, dt, start="z0"):
    """w0 u + sum of w_i p_ri[u]."""
    z = _plays(p, np.broadcast_to(getattr(p, start), p.r.shape) if state is None else state, u["u"])
    return {"y": float(p.w0 * u["u"] + p.w @ z)}, z


def play_bank(p, state, u, t, dt):
    z = _plays(p, p.z0 if state is None else state, u["u"])
    return {"z": z}, z


def bouc_wen(p, state, u, t, dt):
    """dz/du = A - (beta sgn(z du) + gamma) |z|^n, by Runge-Kutta of order 4 along the path of u, from u0 with z0 on."""
    z, last = (p.z0, p.u0) if state is None else state
    steps = max(1, int(np.ceil(abs(u["u"] - last) / 0.005)))
    h = (u["u"] - last) / steps

    def slope(v):
        return p.A - (p.beta * np.sign(v * h) + p.gamma) * abs(v) ** p.n

    for _ in range(steps if h else 0):
        a = slope(z)
        b = slope(z + h * a / 2)
        c = slope(z + h * b / 2)
        z += h * (a + 2 * b + 2 * c + slope(z + h * c)) / 6
    return {"z": z, "y": p.k * (p.alpha * u["u"] + (1 - p.alpha) * z)}, (z, u["u"])


def jiles_atherton(p, state, u, t, dt):
    """dM/dH = chi / (1 - alpha chi), chi = max(0, s (M_an - M)) / k + c dM_an/dH_e, Jiles & Atherton 1986."""
    if p.m0:
        raise NotImplementedError("a magnetised start")
    m, last = (0.0, p.u0) if state is None else state
    steps = max(1, int(np.ceil(abs(u["u"] - last) / 0.005)))
    h = (u["u"] - last) / steps

    def slope(field, m):
        x = (field + p.alpha * m) / p.a
        curve, rise = (x / 3, 1 / 3) if abs(x) < 1e-4 else (1 / np.tanh(x) - 1 / x, 1 / x**2 - 1 / np.sinh(x) ** 2)
        chi = max(0.0, np.sign(h) * (p.Ms * curve - m)) / p.k + p.c * p.Ms / p.a * rise
        return chi / (1 - p.alpha * chi)

    for field in last + h * np.arange(steps if h else 0):
        a = slope(field, m)
        b = slope(field + h / 2, m + h * a / 2)
        c = slope(field + h / 2, m + h * b / 2)
        m += h * (a + 2 * b + 2 * c + slope(field + h, m + h * c)) / 6
    return {"y": m}, (m, u["u"])


def zhao_tan(p, state, u, t, dt):
    """Branches (1 - e^-d) d from the dominant extrema; the history is replaced by them, which is their definition."""
    if p.memory != 0:
        raise NotImplementedError("memory of the last extremum")
    path = np.array([p.x0, u["x"]]) if state is None else np.append(state, u["x"])
    extrema = dominant_extrema(path, p.x0)
    g = lambda d: -np.expm1(-d) * d  # noqa: E731
    h = np.sign(extrema[0] - p.x0) * g(2 * abs(extrema[0] - p.x0)) / 2
    h += sum(np.sign(b - a) * g(abs(b - a)) for a, b in pairwise(extrema))
    return {"h": float(h)}, np.array([p.x0, *extrema])


def zhao_tan_inverse(p, state, u, t, dt):
    """The x at which the operator has the output h."""
    p = SimpleNamespace(memory=0, x0=p.x0)
    h = lambda x: zhao_tan(p, state, {"x": x}, t, dt)[0]["h"] - u["h"]  # noqa: E731
    x = brentq(h, -1e3, 1e3, xtol=1e-14)
    return {"x": x}, zhao_tan(p, state, {"x": x}, t, dt)[1]


def dead_zones(p, state, u, t, dt):
    beyond = u["u"] - p.r
    one_sided = np.where(p.r > 0, np.maximum(beyond, 0), np.where(p.r < 0, np.minimum(beyond, 0), beyond))
    return {"y": float(p.w0 * u["u"] + p.w @ one_sided)}, state


def polynomial_narx(p, state, u, t, dt):
    """theta' phi, phi all monomials of lags of u, f and y, by degree, the constant last."""
    us, fs, ys = state or ([u["u"]] * (p.n_u + 1), [u["f"]] * (p.n_f + 1), [p.y0] * p.n_y)
    if state is not None:
        us, fs = [u["u"], *us[:-1]], [u["f"], *fs[:-1]]
    z = np.array([*us[p.n_k :][: p.n_u], *fs[p.n_k :][: p.n_f], *ys])
    phi = [np.prod(z[list(c)]) for d in range(1, p.q + 1) for c in _monomials(len(z), d)]
    y = float(p.theta @ [*phi, 1.0])
    return {"y": y}, (us, fs, [y, *ys][: p.n_y])


@lru_cache
def _monomials(n, degree):
    return list(combinations_with_replacement(range(n), degree))


# ---- dynamics ------------------------------------------------------------------------------------------------------
@lru_cache(maxsize=256)
def _held(b, a, dt):
    """x+ = A x + B u, y = C x + D u of b(s)/a(s) for an input held over dt, in the companion form of s / |s|."""
    order = len(a) - 1
    scale = max(1.0, max(abs(c / a[0]) ** (1 / k) for k, c in enumerate(a[1:], 1)))
    den = np.array([c / a[0] / scale**k for k, c in enumerate(a)])
    num = np.zeros(order + 1)
    num[order + 1 - len(b) :] = [c / a[0] / scale**k for k, c in enumerate(b, order + 1 - len(b))]
    A = np.diag(np.ones(order - 1), 1)
    A[-1] = -den[:0:-1]
    B = np.eye(order)[:, -1:]
    C = (num - num[0] * den)[:0:-1][None]
    continuous = scale * A, scale * B, C, num[:1][None]
    if dt == 0:
        return continuous
    return cont2discrete(continuous, dt, "zoh")[:4]


def transfer_function(p, state, u, t, dt):
    A, B, C, D = _held(tuple(p.b), tuple(p.a), dt)
    if state is None:
        x = -np.linalg.solve(A, B[:, 0]) * u["u"] if p.start == 1 else np.zeros(len(A))
    elif p.hold == 0:
        x = A @ state[0] + B[:, 0] * u["u"]
    else:
        x = A @ state[0] + B[:, 0] * state[1] + _ramp(tuple(p.b), tuple(p.a), dt) * (u["u"] - state[1])
    return {"y": float(C[0] @ x + D[0, 0] * u["u"])}, (x, u["u"])


@lru_cache(maxsize=256)
def _ramp(b, a, dt):
    """What an input that rises from 0 to 1 over dt adds to the state: 1/dt times the integral of e^(A s) B (dt - s)."""
    A, B, _, _ = _held(b, a, 0)
    n = len(A)
    M = np.zeros((n + 2, n + 2))
    M[:n, :n], M[:n, n], M[n, n + 1] = A * dt, B[:, 0] * dt, 1
    return expm(M)[:n, n + 1]


def modes(p, state, u, t, dt):
    """Sum of k_i w_i^2 / (s^2 + 2 zeta_i w_i s + w_i^2)."""
    y, after = 0.0, []
    for i, (f, zeta, k) in enumerate(zip(p.f_n, p.zeta, p.k, strict=True)):
        w = 2 * np.pi * f
        A, B, C, _ = _held((w * w,), (1.0, 2 * zeta * w, w * w), dt)
        x = np.zeros(2) if state is None else A @ state[i] + B[:, 0] * u["u"]
        y += k * float(C[0] @ x)
        after.append(x)
    return {"y": y}, after


def amplifier(p, state, u, t, dt):
    """y' = clamp(2 pi f_b (clamp(u) - y), i_max/C): at constant rate down to the error that the lag removes as fast."""
    w, wanted = 2 * np.pi * p.f_b, min(max(u["u"], p.u_min), p.u_max)
    error, near = wanted - (state or 0.0), p.i_max / p.C / w
    fast = min(max((abs(error) - near) / (w * near), 0.0), dt)
    left = (abs(error) - w * near * fast) * np.exp(-w * (dt - fast)) if dt else abs(error)
    over = max(left - near, 0.0)
    return {"y": wanted - np.sign(error) * left, "excess": u["u"] - wanted + np.sign(error) * over}, (
        wanted - np.sign(error) * left
    )


def creep(p, state, u, t, dt):
    """w0 u and the lags T q' = u - q, for an input held over the step."""
    if state is None:
        state = np.full(len(p.T), u["u"] if p.start == 1 else 0.0)
    state = u["u"] + (state - u["u"]) * np.exp(-dt / p.T)
    return {"y": float(p.w @ state + p.w0 * u["u"])}, state


def bouc_wen_oscillator(p, state, u, t, dt):
    """m y'' + c y' + k y + z = u by the trapezoidal rule for y, y' and z together; u runs linearly over the step."""

    def rates(x, force):
        y, v, z = x
        dz = p.alpha * v - p.beta * (p.gamma * abs(v) * abs(z) ** (p.nu - 1) * z + p.delta * v * abs(z) ** p.nu)
        return np.array([v, (force - p.c_L * v - p.k_L * y - z) / p.m_L, dz])

    if state is None:
        return {"y": 0.0, "z": 0.0}, (np.zeros(3), u["u"])
    x, last = state
    begin = x + dt / 2 * rates(x, last)
    x = x + dt * rates(x, last)
    for _ in range(100):
        before, x = x, begin + dt / 2 * rates(x, u["u"])
        if np.all(np.abs(x - before) <= 1e-15 + 1e-13 * np.abs(x)):
            break
    return {"y": x[0], "z": x[2]}, (x, u["u"])


def modified_bouc_wen(p, state, u, t, dt):
    """c_1 w' = alpha z + k_0 (u - w) + c_0 (u' - w') for a ramp of u, by midpoint steps; w = u at the start."""
    w, z, begin = (u["u"], p.z0, u["u"]) if state is None else state
    v, steps = (u["u"] - begin) / dt if dt else 0.0, int(np.ceil(100 * (dt + abs(u["u"] - begin)))) if dt else 0
    h = dt / max(steps, 1)

    def rates(at, w, z):
        moved = (p.alpha * z + p.k_0 * (begin + v * at - w) + p.c_0 * v) / (p.c_0 + p.c_1)
        d, size = v - moved, abs(z) ** (p.n - 1)
        return moved, p.A * d - p.gamma * abs(d) * size * z - p.beta * d * size * abs(z)

    for k in range(steps):
        a, b = rates(k * h, w, z)
        a, b = rates((k + 0.5) * h, w + h / 2 * a, z + h / 2 * b)
        w, z = w + h * a, z + h * b
    return {"y": p.c_1 * rates(dt, w, z)[0] + p.k_1 * (u["u"] - p.x_0)}, (w, z, u["u"])


def delay(p, state, u, t, dt):
    """y_k = u_(k-n), y0 before."""
    past = (p.y0,) * p.n if state is None else state
    return {"y": past[0]}, (*past[1:], u["u"])


def _difference(p, last, e, dt):
    """(de, e) of the filtered derivative tau de' + de = e', backward rule; none at the start."""
    if last is None:
        return 0.0, e
    return (p.tau * last[0] + e - last[1]) / (p.tau + dt), e


def differentiator(p, state, u, t, dt):
    state = _difference(p, state, u["u"], dt)
    return {"du": state[0]}, state


# ---- controllers ---------------------------------------------------------------------------------------------------
def _limited(p, u):
    return min(max(u, p.u_min), p.u_max)


def _integrated(p, integral, step, law):
    """The integral after a step; conditional integration: none that moves the command further out of its limits."""
    before, after = law(integral), law(integral + step)
    out = (after > p.u_max and after > before) or (after < p.u_min and after < before)
    return integral if out else integral + step


def pid(p, state, u, t, dt):
    """u_ff + Kp e + Ki int e + Kd e', Astrom & Hagglund 1995, ch. 3; backward rule."""
    integral, difference = state or (0.0, None)
    e = u["y_d"] - u["y"]
    difference = _difference(p, difference, e, dt)
    law = lambda i: u["u_ff"] + p.Kp * e + p.Ki * i + p.Kd * difference[0]  # noqa: E731
    integral = _integrated(p, integral, e * dt, law)
    return {"u": _limited(p, law(integral))}, (integral, difference)


def sliding_mode(p, state, u, t, dt):
    """u_ff - eta s - rho s / (|s| + epsilon), s = e' + lam e + k_i int e, Yu & Alici 2005."""
    integral, difference = state or (0.0, None)
    e = u["y"] - u["y_d"]
    difference = _difference(p, difference, e, dt)
    line = lambda i: difference[0] + p.lam * e + p.k_i * i  # noqa: E731

    def law(i):
        s = line(i)
        switched = np.clip(s / p.epsilon, -1, 1) if p.switching == 1 else s / (abs(s) + p.epsilon)
        return u["u_ff"] - p.eta * s - p.rho * switched

    integral = _integrated(p, integral, e * dt, law)
    return {"u": _limited(p, law(integral)), "s": line(integral)}, (integral, difference)


def super_twisting(p, state, u, t, dt):
    """Levant 1993, Moreno 2009: -k_1 (|s|^1/2 sgn s + mu s) - k_2 v; sgn s = s / (|s| + epsilon)."""
    v, difference = state or (0.0, None)
    e = u["y"] - u["y_d"]
    difference = _difference(p, difference, e, dt)
    s = difference[0] + p.lam * e
    size = abs(s) + p.epsilon
    rate = s / size / 2 + 1.5 * p.mu * np.sqrt(size) * s / size + p.mu**2 * s
    law = lambda v: u["u_ff"] - p.k_1 * (np.sqrt(size) * s / size + p.mu * s) - p.k_2 * v  # noqa: E731
    v = _integrated(p, v, rate * dt, law)
    return {"u": _limited(p, law(v)), "s": s}, (v, difference)


def lead_lag(p, state, u, t, dt):
    """K prod (T_z s + 1) / (T_p s + 1) e with s = 2/dt (z - 1) / (z + 1): a difference equation for each section."""
    e = u["y_d"] - u["y"]
    state, after = [(e, e)] * p.n if state is None else state, []
    for T_z, T_p, (e_last, y_last) in zip(p.T_z, p.T_p, state, strict=True):
        y = e * T_z / T_p + (1 - T_z / T_p) * e_last  # the lag rests in equilibrium with the first error
        if dt > 0:
            y = ((2 * T_z + dt) * e + (dt - 2 * T_z) * e_last - (dt - 2 * T_p) * y_last) / (2 * T_p + dt)
        after.append((e, y))
        e = y
    return {"u": _limited(p, u["u_ff"] + p.K * e)}, after


@lru_cache(maxsize=64)
def _observer(f_n, zeta, gain, f_o, dt):
    """F and G of y, y', d over a step with a held command, and gains M that put every pole at exp(-2 pi f_o dt)."""
    w, z = 2 * np.pi * f_n, np.exp(-2 * np.pi * f_o * dt)
    A = np.array([[0, 1, 0, 0], [-w * w, -2 * zeta * w, gain * w * w, gain * w * w], [0, 0, 0, 0], [0, 0, 0, 0]])
    E = expm(A * dt)
    F, G = E[:3, :3], E[:3, 3]
    scale = np.diag([1, w, 1])
    at = z + np.array([0.3, 0.6, 0.9j])  # det(s - F + M H F) = det(s - F) (1 + H F (s - F)^-1 M) = (s - z)^3
    rows = [(F @ np.linalg.inv(s * np.eye(3) - F))[0] @ scale for s in at]
    right = [(s - z) ** 3 / np.linalg.det(s * np.eye(3) - F) - 1 for s in at]
    return F, G, scale @ np.linalg.solve(np.array(rows), np.array(right)).real


def disturbance_observer(p, state, u, t, dt):
    """State observer of the plant with a constant disturbance, n steps from a command to its response."""
    if state is None:
        x, commands = np.array([u["y"], 0.0, 0.0]), [0.0] * p.n
    else:
        x, commands = state
        F, G, M = _observer(p.f_n, p.zeta, p.gain, p.f_o, dt)
        x = F @ x + G * commands[-1]
        x = x + M * (u["y"] - x[0])
    command = _limited(p, u["u_c"] - x[2])
    return {"u": command, "d_hat": x[2]}, (x, [command, *commands[:-1]])


def iterative_learning(p, state, u, t, dt):
    """u_ff + w_k; after each period w <- Q (w + gain e_(k + lead))."""
    w, e = (np.zeros(p.n), []) if state is None else state
    if len(e) == p.n:
        w = w + p.gain * np.roll(e, -int(p.lead))
        w, e = p.smooth * (np.roll(w, 1) + np.roll(w, -1)) + (1 - 2 * p.smooth) * w, []
    e = [*e, u["y_d"] - u["y"]]
    return {"u": _limited(p, u["u_ff"] + w[len(e) - 1])}, (w, e)


def repetitive(p, state, u, t, dt):
    """y_d + w_k, w_k = sum of q_|j| w_(k-n+j) and of l_j e_(k-n+j)."""
    reach = p.n + max(p.n_q, p.n_l)
    w, e = (np.zeros(reach), np.zeros(reach)) if state is None else state
    q = np.concatenate([p.q[:0:-1], p.q])
    same = reach - p.n  # the step one period before this one
    now = q @ w[same - p.n_q : same + p.n_q + 1] + p.l @ e[same - p.n_l : same + p.n_l + 1]
    error = u["y_d"] - u["y"] if u["active"] > 0 else 0.0
    return {"r": u["y_d"] + now}, (np.append(w[1:], now), np.append(e[1:], error))


def adaptive_inverse(p, state, u, t, dt):
    """u with theta' (u, plays of u) = v; theta by the Kalman filter of a random walk, Ljung & Gunnarsson 1990."""
    first, sd2 = np.append(p.w0, p.w), p.sd**2
    if state is None:
        s = SimpleNamespace(theta=first, P=p.start**2 * np.diag(sd2), wrong=0, count=0.0, since=p.pause)
        s.z = s.z_then = np.full(p.n, p.u0)
        s.phi, s.rate, s.commands = np.full(p.n + 1, p.u0), np.zeros(p.n + 1), [p.u0] * (p.delay + 1)
        s.low, s.y_low = (s.phi, u["y"]) if p.f_h > 0 else (0 * s.phi, 0.0)
        s.learned, s.y_hat = 0.0, first @ s.phi
    else:
        s = SimpleNamespace(**vars(state))
        then, share = s.commands[p.delay], 1 - np.exp(-2 * np.pi * p.f_h * dt)
        s.z_then = _plays(p, s.z_then, then)
        s.phi, s.rate = _second_order(p, s.phi, s.rate, np.append(then, s.z_then), dt)
        s.low, s.y_low = s.low + share * (s.phi - s.low), s.y_low + share * (u["y"] - s.y_low)
        fast = s.phi - s.low
        s.y_hat, e = s.theta @ s.phi, u["y"] - s.y_low - s.theta @ fast
        s.since, s.learned = s.since + dt, float(u["y_d"] != s.y_d)
        if s.learned:
            g = s.P @ fast
            alpha = g @ fast + max(p.sigma**2, 1e-10 * (g @ fast))
            s.theta = s.theta + g * e / alpha
            s.P = s.P - np.outer(g, g) / alpha + np.diag(dt / p.T * sd2)
            size = np.sqrt(np.diag(s.P))
            down = np.where(size > p.sd, p.sd / np.where(size > 0, size, 1), 1)
            s.P = s.P * np.outer(down, down)
            s.wrong = s.wrong + 1 if abs(e) > p.change and s.since >= p.pause else 0
            if s.wrong == 6:
                s.P, s.wrong, s.since, s.count = np.diag(sd2), 0, 0.0, s.count + 1
            least = np.maximum(first - p.box * p.sd, np.append(p.w0_min, np.zeros(p.n)))
            s.theta = np.clip(s.theta, least, first + p.box * p.sd)
        s.commands = [s.commands[0], *s.commands[:-1]]
    miss = lambda x: s.theta @ np.append(x, _plays(p, s.z, x)) - u["v"]  # noqa: E731
    reach = abs(miss(s.commands[0])) / s.theta[0] + 1e-12  # no slope is smaller
    x = brentq(miss, s.commands[0] - reach, s.commands[0] + reach, xtol=1e-15)
    x = _limited(p, x)
    s.commands = [x, *s.commands[1:]]
    s.z, s.y_d = _plays(p, s.z, x), u["y_d"]
    return {"u": x, "theta": s.theta, "y_hat": s.y_hat, "gate": s.learned, "changes": s.count}, s


def recursive_least_squares(p, state, u, t, dt):
    """Eqs. 13 to 19 of the IPMC paper with P itself, e^2 in the place of sigma^2, nothing changed in the dead zone."""
    theta, P, count = state or (p.theta0, p.eta * np.eye(p.n), 0.0)
    phi = u["phi"]
    before, e = theta, u["y"] - phi @ theta
    if state is not None and abs(e) > p.r:
        Pphi = P @ phi
        gain, s = phi @ Pphi, p.share * (e**2 - p.r**2) / p.r**2
        K = s * Pphi / ((1 + s) * gain)
        theta, P, count = theta + K * e, (P - np.outer(K, Pphi)) / p.mu, count + 1
        P = (P + P.T) / 2
    return {"y_hat": phi @ before, "theta": theta, "learned": count}, (theta, P, count)


def _second_order(p, y, rate, u, dt):
    """Position and velocity of 1 / (s^2 / w^2 + 2 zeta s / w + 1) over a step with a held input, for each input."""
    if p.f_n == 0:
        return u, rate
    w = 2 * np.pi * p.f_n
    E = _exponential(((0, 1, 0), (-w * w, -2 * p.zeta * w, w * w), (0, 0, 0)), dt)
    return tuple(E[:2] @ np.array([y, rate, u]))


@lru_cache(maxsize=64)
def _exponential(rows, dt):
    return expm(np.array(rows) * dt)


# ---- sources -------------------------------------------------------------------------------------------------------
SINE, TRIANGLE, DECAYING, MULTISINE, STEPS = range(5)


def disturbance(p, state, u, t, dt):
    return {"d": p.step * (t >= p.t_step) + p.amplitude * np.sin(2 * np.pi * p.frequency * t + p.phase)}, state


def reference(p, state, u, t, dt):
    """Signal, and the signal with its two derivatives `lead` ahead."""
    (r, _, _), ahead = _signal(p, t), _signal(p, t + p.lead)
    r, ahead = p.offset + p.amplitude * r, p.amplitude * np.array(ahead)
    return {"r": r, "r_lead": p.offset + ahead[0], "dr_lead": ahead[1], "ddr_lead": ahead[2]}, state


def _signal(p, t):
    w = 2 * np.pi * p.frequency
    if p.shape in (SINE, DECAYING):
        root = 1j * w - (p.decay if p.shape == DECAYING else 0)
        z = np.exp(root * t + 1j * p.phase)
        return z.imag, (root * z).imag, (root**2 * z).imag
    if p.shape == MULTISINE:
        w = 2 * np.pi * p.f
        z = p.a * np.exp(1j * (w * t + p.ph))
        return z.imag.sum(), (w * z).real.sum(), -(w * w * z.imag).sum()
    if p.shape == TRIANGLE:
        return _triangle((p.frequency * t + p.phase / 2 / np.pi) % 1, p.turn / 4, p.frequency)
    if p.shape == STEPS:
        return p.levels[min(int(t / p.T * (1 + 1e-9)), len(p.levels) - 1)], 0.0, 0.0
    raise NotImplementedError("shape of the reference")


def _triangle(q, reach, f):
    """Lines of speed v and, up to `reach` of a period around the extrema 1 and -1, parabolas of curvature v / reach."""
    side = 1 if q < 0.5 else -1
    v, d = 4 / (1 - 2 * reach), (q % 0.5) - 0.25
    if abs(d) < reach:
        return side * (1 - v / reach * d * d / 2), -side * v / reach * d * f, -side * v / reach * f * f
    return side * (v * (0.25 - abs(d))), -np.sign(d) * side * v * f, 0.0


BLOCKS = {
    "sum": weighted_sum, "scaling": scaling, "product": product, "in_range": in_range, "feedforward": feedforward,
    "mlp": mlp, "quantiser": quantiser, "backlash_sum": play_sum, "prandtl_ishlinskii": partial(play_sum, start="u0"),
    "play_bank": play_bank, "bouc_wen": bouc_wen, "jiles_atherton": jiles_atherton, "zhao_tan": zhao_tan,
    "zhao_tan_inverse": zhao_tan_inverse, "dead_zones": dead_zones, "polynomial_narx": polynomial_narx, "creep": creep,
    "modes": modes, "amplifier": amplifier, "bouc_wen_oscillator": bouc_wen_oscillator,
    "modified_bouc_wen": modified_bouc_wen, "transfer_function": transfer_function, "delay": delay,
    "differentiator": differentiator, "pid": pid, "sliding_mode": sliding_mode, "super_twisting": super_twisting,
    "lead_lag": lead_lag, "disturbance_observer": disturbance_observer, "iterative_learning": iterative_learning,
    "repetitive": repetitive, "adaptive_inverse": adaptive_inverse, "recursive_least_squares": recursive_least_squares,
    "disturbance": disturbance, "reference": reference,
}  # fmt: skip


def parameters(node):
    """The values of a block of a scenario, scalars and arrays by their names in the papers; words as their number."""
    values = {v.name: (v, np.asarray(node.value(v.name), dtype=float)) for v in node.block.parameters}
    return SimpleNamespace(**node.dims, **{k: float(x[0]) if v.size == "1" else x for k, (v, x) in values.items()})
