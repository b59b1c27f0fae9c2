"""Plants with random parameters, in numpy, from rest at 0 for inputs in [-1, 1]; independent of the package."""

import numpy as np
from plants import bouc_wen, plays


def _sum_of_plays(rng):
    """(3 u + ten plays with random thresholds and weights) / 8."""
    r, w = np.sort(rng.uniform(0.05, 0.6, 10)), rng.uniform(0.3, 1.7, 10)
    return lambda u: (3 * u + plays(u, r) @ w) / 8


def _bent(rng):
    """A sum of plays through a bend that stays monotone."""
    z, (b, c) = _sum_of_plays(rng), rng.uniform(-0.15, 0.15, 2)
    return lambda u: z(u) + b * z(u) ** 2 + c * z(u) ** 3


def _bouc_wen(rng):
    """A Bouc-Wen operator and a linear term."""
    beta, share = rng.uniform(0.7, 1.5), rng.uniform(0.2, 0.8)
    values = {"A": rng.uniform(0.8, 1.5), "beta": beta, "gamma": share * beta, "n": rng.uniform(1.1, 2.0)}
    values |= {"a": rng.uniform(0.2, 0.6), "b": rng.uniform(0.5, 1.0), "c": rng.uniform(-0.3, 0.3)}
    return lambda u: bouc_wen(u, **values)


def _stop_like(rng):
    """Ten stops with random thresholds and weights through a cubic bend."""
    r, w, b = np.sort(rng.uniform(0.05, 0.8, 10)), rng.uniform(0.3, 1.7, 10), rng.uniform(0.05, 0.3)
    size = float(r @ w)

    def plant(u):
        z = (u[:, None] - plays(u, r)) @ w / size
        return z + b * z**3

    return plant


def _butterfly(rng):
    """The square of a sum of plays."""
    z = _sum_of_plays(rng)
    return lambda u: z(u) ** 2


FAMILIES = {
    "plays": _sum_of_plays, "bent plays": _bent, "Bouc-Wen": _bouc_wen, "stop-like": _stop_like,
    "butterfly": _butterfly,
}  # fmt: skip


def draw(family, seed):
    """Return a plant of a family, a function of the input (n,)."""
    return FAMILIES[family](np.random.default_rng([seed, list(FAMILIES).index(family)]))
