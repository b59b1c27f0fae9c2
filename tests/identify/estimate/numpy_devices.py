"""Devices written from their equations in numpy, and the graphs that are fitted to them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

import hystfmu as hy

H = 1e-3


def multisine(rng, rows, most=60.0):
    """Tones of 1 Hz to `most` at random phases, within -1 and 1."""
    t = H * np.arange(rows)
    tones = [np.sin(2 * np.pi * f * t + rng.uniform(0, 2 * np.pi)) / (1 + f / 10) for f in np.arange(1.0, most)]
    u = np.sum(tones, axis=0)
    return t, u / np.abs(u).max()


def plays(u, r, w, w0, first):
    """w0 u + sum w_i p_i, the plays at `first` before row 0."""
    p, y = np.array(first, dtype=float), np.empty(len(u))
    for k, v in enumerate(u):
        p = np.clip(p, v - np.asarray(r), v + np.asarray(r))
        y[k] = w0 * v + np.dot(w, p)
    return y


def bouc_wen(u, beta, gamma, n, fine=40):
    """z for A = 1 by Runge-Kutta in u, `fine` steps a row."""

    def slope(z, s):
        size = abs(z) ** (n - 1)
        return 1 - beta * s * size * z - gamma * size * abs(z)

    z, found = 0.0, np.zeros(len(u))
    for k in range(1, len(u)):
        d = (u[k] - u[k - 1]) / fine
        s = np.sign(d)
        for _ in range(fine if d else 0):
            a = slope(z, s)
            b = slope(z + d * a / 2, s)
            c = slope(z + d * b / 2, s)
            z += d * (a + 2 * b + 2 * c + slope(z + d * c, s)) / 6
        found[k] = z
    return found


def second_order(x, f_n, zeta):
    """The response of omega^2 / (s^2 + 2 zeta omega s + omega^2) to ramps between rows, from its steady state."""
    from scipy.signal import cont2discrete, lfilter, lfiltic

    w = 2 * np.pi * f_n
    b, a, _ = cont2discrete(([w * w], [1, 2 * zeta * w, w * w]), H, "foh")
    b = np.ravel(b)
    return lfilter(b, a, x, zi=lfiltic(b, a, [x[0]] * 2, [x[0]] * 2))[0]


def noisy(rng, y, share=1e-3):
    return y + share * np.ptp(y) * rng.normal(size=len(y))


def chain(*nodes):
    """Nodes one behind the other, from the input u to the output y."""
    wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(nodes)]
    return hy.Graph(nodes, wires, [hy.Input("u", (f"{nodes[0].name}.u",))], [hy.Output("y", f"{nodes[-1].name}.y")])


def g0(f_n, zeta):
    w = 2 * np.pi * f_n
    return hy.Node(
        "g0", "transfer_function", {}, {"b": [w * w], "a": [1.0, 2 * zeta * w, w * w], "hold": "foh", "start": "steady"}
    )


def within(model, true, most=5.0):
    """Standard errors between what was found and what is true, each at most `most`."""
    found = model.fit["free"]
    assert set(found) >= set(true)
    off = {k: (found[k]["value"] - v) / found[k]["standard_error"] for k, v in true.items()}
    assert max(map(abs, off.values())) < most, off
