"""Devices written from their equations in numpy, and the graphs that are fitted to them."""

import numpy as np
import plants
from foreign import solvers
from foreign.solvers import FINER, fine, mode

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
    return w0 * u + plants.plays(u, np.asarray(r), np.asarray(first, dtype=float)) @ np.asarray(w)


def bouc_wen(u, beta, gamma, n):
    """z for A = 1 and z = 0 before row 0."""
    return solvers.bouc_wen(fine(u), beta, gamma, n)[::FINER]


def second_order(x, f_n, zeta):
    """The response of omega^2 / (s^2 + 2 zeta omega s + omega^2) to ramps between rows, from its steady state."""
    return mode(x, f_n, zeta, H)


def noisy(rng, y, share=1e-3):
    return y + share * np.ptp(y) * rng.normal(size=len(y))


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
