"""Bouc-Wen model, y = c + a u + b z(u; beta, gamma, n), for loops that a sum of plays cannot represent.

A change of A has no effect on y if beta, gamma and the weight b are changed, too. A = 1 removes this redundancy. The
slope of z is then 1 at z = 0. The nonlinear parameters are the limit z_max = (beta + gamma)^(-1/n) of |z|, the ratio
gamma / (beta + gamma), the exponent n, and the initial value of z. For each trial, linear least squares gives the
offset, the linear term and the weight of z (variable projection, Golub & Pereyra 1973). Sources: Wen 1976; Ikhouane &
Rodellar 2007.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array, Progress
from hystfmu.data import Dataset
from hystfmu.graph import Node
from hystfmu.identify.catalogue import OPENS, Built, Candidate, Option, Options
from hystfmu.identify.estimate.coordinates import Coordinates
from hystfmu.identify.estimate.objective import Linear, Objective
from hystfmu.identify.estimate.search import determined, search
from hystfmu.identify.features.plays import DEAD_BAND
from hystfmu.identify.graphs import device, scaled_input

TEXT = "Bouc-Wen operator as a grey box, nonlinear least squares"
CANDIDATES = (Candidate(OPENS, 0.2, 0.4, quick={"starts": 1}),)
OPTIONS = (
    Option("starts", 6, 1, 1000, text="start values of the search"),
    Option("n_max", 6.0, 1.0, 20.0, text="largest exponent n tried"),
    Option("z0", None, -1.0, 1.0, text="z at the first row, as a fraction of its bound; default: fitted"),
    DEAD_BAND,
)


def shape(p: Array, node: str = "operator") -> dict[str, float]:
    """Return the parameters of the block `node` for a point p of the search, with A = 1.

    The elements of p are ln z_max, gamma / (beta + gamma), n and z0 / z_max.
    """
    z_max, share, n = float(np.exp(p[0])), float(p[1]), float(p[2])
    total = z_max**-n
    values = {"beta": (1 - share) * total, "gamma": share * total, "n": n, "z0": 0.999999 * float(p[3]) * z_max}
    return {f"{node}.{name}": value for name, value in values.items()}


def limits(n_max: float) -> tuple[Array, Array, Array]:
    """Return the lower bounds, the upper bounds and the scales of the four search variables; n is at most `n_max`."""
    return np.array([np.log(1e-3), -1.0, 1.0, -1.0]), np.array([np.log(1e2), 1.0, n_max, 1.0]), np.full(4, 0.3)


def nodes(data: Dataset) -> list[Node]:
    """Return the blocks ``input``, which scales u to about [-1, 1], and ``operator``."""
    scaling, gain, offset = scaled_input(data.u[: data.train.stop])  # later rows do not affect the training rows
    first = gain * float(data.u[0]) + offset
    return [scaling, Node("operator", "bouc_wen", {}, {"A": 1.0, "alpha": 0.0, "k": 1.0, "u0": first})]


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit the graph ``(scaling, bouc_wen) -> sum``; return graph, number of parameters, further results."""
    lo, hi, scale = limits(options["n_max"])
    if options["z0"] is not None:
        lo[3], hi[3] = options["z0"] - 1e-9, options["z0"] + 1e-9
    wires = [("input.y", "operator.u"), ("input.y", "readout.u[1]"), ("operator.z", "readout.u[2]")]
    graph = device(data, [*nodes(data), Node("readout", "sum", {"n": 2})], wires)
    linear = (Linear("readout.k", (0, 1)), Linear("readout.offset"))
    objective = Objective(data, graph, Coordinates(lo, hi, scale, shape), linear)
    rng = np.random.default_rng(seed)
    starts = [np.array([np.log(0.5), 0.5, 1.5, 0.0]), *(_draw(rng, lo, hi) for _ in range(options["starts"] - 1))]
    p = search(objective, starts, progress).p
    return objective.graph(p), 7, {"bounded": searched(p, lo, hi), "free": determined(objective, p).table}


def searched(p: Array, lo: Array, hi: Array) -> dict[str, tuple[float, float, float]]:
    """Return name, value and bounds of the first three elements of p, from the bounds lo and hi.

    These elements are ln z_max, gamma / (beta + gamma) and n. The lower bound of n is replaced by 0, so that n = 1 is
    not reported as a value at a bound.
    """
    limits = zip(("ln z_max", "gamma / (beta + gamma)", "n"), p, (lo[0], lo[1], 0.0), hi, strict=False)
    return {name: (float(value), float(least), float(most)) for name, value, least, most in limits}


def _draw(rng: np.random.Generator, lo: Array, hi: Array) -> Array:
    return np.array([rng.uniform(np.log(0.05), np.log(3)), rng.uniform(0, 1), rng.uniform(lo[2], min(hi[2], 3.0)), 0.0])
