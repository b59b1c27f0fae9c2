"""Black box for the Bouc-Wen benchmark: a network of lagged forces and displacements, trained in simulation.

  y(k) = a'x(k) + W2 tanh(W1 x(k) + b1) + b2,   x(k) = (u(k), .., u(k-L), y(k-1), .., y(k-L))

The first stage is a one-step-ahead regression on measured lags, biased by their noise.  The second stage uses the
model's own lags: the derivatives of a free run obey s(k) = dy/dp + sum_j dy/dy(k-j) s(k-j) (real-time recurrent
learning, Williams & Zipser 1989) and form the Jacobian of Levenberg-Marquardt.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.identify.network.training import train
from hystfmu.identify.solvers.levenberg_marquardt import minimise

RIDGE = 1e-5  # on the parameters, relative to the scaled output


@dataclass(frozen=True)
class NarxNetwork:
    """Weights (a, W1 row by row, b1, W2, b2) for scaled force and displacement."""

    p: Array
    lags: int
    hidden: int
    gain_u: float
    gain_y: float

    def run(self, u: Array) -> Array:
        """Return the displacement (n,) for a force u (n,), from rest."""
        return simulate(self.p, u * self.gain_u, np.zeros(self.lags), self.lags, self.hidden)[0] / self.gain_y


def _split(p: Array, lags: int, hidden: int) -> tuple[Array, Array, Array, Array, float]:
    n = 2 * lags + 1
    at = np.cumsum([n, hidden * n, hidden, hidden])
    a, W1, b1, W2, b2 = np.split(p, at)
    return a, W1.reshape(hidden, n), b1, W2, float(b2[0])


def simulate(
    p: Array, u: Array, before: Array, lags: int, hidden: int, derivatives: bool = False
) -> tuple[Array, Array]:
    """Run the network free, with derivatives by p.

    Parameters
    ----------
    p : array, shape (m,)
        Parameters.
    u : array, shape (n,)
        Scaled force; before row 0 it equals row 0.
    before : array, shape (lags,)
        Scaled displacements before row 0, oldest first.
    lags, hidden : int
        Size of the network.
    derivatives : bool
        Compute s.

    Returns
    -------
    y : array, shape (n,)
        Scaled displacement; a run that leaves [-10, 10] stays at that limit.
    s : array, shape (n, m)
        Derivatives of y by p; empty without `derivatives`.
    """
    a, W1, b1, W2, b2 = _split(p, lags, hidden)
    n = len(u)
    past_u = np.concatenate([np.full(lags, u[0]), u])
    y = np.concatenate([before, np.zeros(n)])
    s = np.zeros((n + lags if derivatives else 0, len(p)))
    direct = np.empty(len(p))
    width = 2 * lags + 1
    x = np.empty(width)
    for k in range(n):
        x[: lags + 1] = past_u[k : k + lags + 1]  # oldest first, which avoids a reversal in the loop
        x[lags + 1 :] = y[k : k + lags]
        t = np.tanh(W1 @ x + b1)
        value = float(a @ x + W2 @ t) + b2
        if not abs(value) < 10:
            y[k + lags :] = np.copysign(10.0, value)
            break
        y[k + lags] = value
        if derivatives:
            g = W2 * (1 - t * t)
            direct[:width] = x
            direct[width : width * (hidden + 1)] = np.outer(g, x).ravel()
            direct[width * (hidden + 1) : -hidden - 1] = g
            direct[-hidden - 1 : -1] = t
            direct[-1] = 1
            s[k + lags] = direct + (a[lags + 1 :] + g @ W1[:, lags + 1 :]) @ s[k : k + lags]
    return y[lags:], s[lags:]


def fit_narx(
    u: Array,
    y: Array,
    lags: int,
    hidden: int,
    iterations: tuple[int, int],
    progress: Callable[[float], None],
    skip: int = 200,
    seed: int = 0,
) -> NarxNetwork:
    """Train on force and displacement.

    Parameters
    ----------
    u, y : array, shape (n,)
        Force and displacement, evenly sampled.
    lags, hidden : int
        Size of the network.
    iterations : (int, int)
        Levenberg-Marquardt iterations, one step ahead and in simulation.
    progress : function
        Called with the fraction done.
    skip : int
        First rows of the free run that do not count, because it starts from measured displacements.
    seed : int
        Seed of the initial weights.
    """
    gain_u, gain_y = 1 / float(np.abs(u).max()), 1 / float(np.abs(y).max())
    su, sy = u * gain_u, y * gain_y
    n = len(u) - lags
    x = np.column_stack([su[j : j + n] for j in range(lags + 1)] + [sy[j : j + n] for j in range(lags)])
    target = sy[lags:]
    a = np.linalg.lstsq(x, target, rcond=None)[0]
    rest = target - x @ a
    gain = 1 / float(np.abs(rest).max())
    net, _ = train(
        x, rest * gain, hidden, "tanh", 1, iterations[0], 1e-7, seed, None, lambda f: progress(0.3 * f), len(x)
    )
    p = np.concatenate([a, net.W1.ravel(), net.b1, net.W2 / gain, [net.b2 / gain]])
    size = float(np.sqrt(np.mean(sy**2))) * np.sqrt(len(sy))

    def function(p: Array) -> tuple[Array, Array]:
        free, s = simulate(p, su[lags:], sy[:lags], lags, hidden, derivatives=True)
        e = np.concatenate([(free - target)[skip:] / size, RIDGE * p])
        return e, np.vstack([s[skip:] / size, RIDGE * np.eye(len(p))])

    p, _ = minimise(p, function, iterations[1], progress=lambda f: progress(0.3 + 0.7 * f))
    return NarxNetwork(p, lags, hidden, gain_u, gain_y)
