"""Bouc-Wen operator with a searched shape, alone or followed by linear dynamics with delay.

bouc_wen     y = c + a u + b z(u; beta, gamma, n), for loops that a sum of plays cannot represent
g0_bouc_wen  y = c + e^(-s tau) G0(s) (a u + b z(u; beta, gamma, n))

A change of A has no effect on y if beta, gamma and the weight b are changed, too. A = 1 removes this redundancy. The
slope of z is then 1 at z = 0. The search variables are the limit z_max = (beta + gamma)^(-1/n) of |z|, the ratio
gamma / (beta + gamma), the exponent n, and the initial value of z. The module `template` contains the search. Sources:
Wen 1976; Ikhouane & Rodellar 2007.
"""

import numpy as np

from hystfmu.base import Array, Progress
from hystfmu.data import Dataset
from hystfmu.graph import Node
from hystfmu.identify.catalogue import LATE, OPENS, Built, Candidate, Memory, Option, Options, Row, scaled_input
from hystfmu.identify.estimate.dynamics import DYNAMICS_OPTIONS
from hystfmu.identify.estimate.template import Template, Variable, build
from hystfmu.identify.features.plays import DEAD_BAND

N_MAX = Option("n_max", 6.0, 1.0, 20.0, text="largest exponent n tried")
# values of z_max, gamma / (beta + gamma) and n: starts of the search, and operators with fixed shapes
STARTS = ((0.5, 0.5, 1.5), (0.15, 0.2, 1.2), (2.0, 0.5, 1.5))
BANK = tuple((z_max, share, n) for z_max in (0.1, 0.3, 1.0, 3.0) for share in (0.0, 0.5) for n in (1.0, 2.0))


def variables(n_max: float) -> tuple[Variable, ...]:
    """Return the search variables of a Bouc-Wen operator; n is at most `n_max`.

    The reported lower bound of n is 0, so that n = 1 is not reported as a value at a bound.
    """
    return (
        Variable("ln z_max", np.log(1e-3), np.log(1e2), 0.3),
        Variable("gamma / (beta + gamma)", -1.0, 1.0, 0.3),
        Variable("n", 1.0, n_max, 0.3, told=0.0),
        Variable("", -1.0, 1.0, 0.3),
    )


def shape(p: Array, node: str = "operator") -> dict[str, float]:
    """Return the parameters of the block `node` for a point p of the search, with A = 1.

    The elements of p are ln z_max, gamma / (beta + gamma), n and z0 / z_max.
    """
    z_max, share, n = float(np.exp(p[0])), float(p[1]), float(p[2])
    total = z_max**-n
    values = {"beta": (1 - share) * total, "gamma": share * total, "n": n, "z0": 0.999999 * float(p[3]) * z_max}
    return {f"{node}.{name}": value for name, value in values.items()}


def _operator(u: Array, searched: tuple[Variable, ...], starts: tuple[Array, ...]) -> Template:
    scaling, gain, offset = scaled_input(u)
    first = gain * float(u[0]) + offset
    operator = Node("operator", "bouc_wen", {}, {"A": 1.0, "alpha": 0.0, "k": 1.0, "u0": first})
    bank = tuple(point(*values) for values in BANK)
    return Template([scaling, operator], shape, searched, ("input.y", "operator.z"), starts, bank)


def point(z_max: float, share: float, n: float) -> Array:
    """Return the search variables of a Bouc-Wen operator whose initial z is 0."""
    return np.array([np.log(z_max), share, n, 0.0])


def bouc_wen(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit the graph ``(scaling, bouc_wen) -> sum``; return graph, number of parameters, further results."""
    searched = variables(options["n_max"])
    if options["z0"] is not None:
        searched = (*searched[:3], Variable("", options["z0"] - 1e-9, options["z0"] + 1e-9, 0.3))
    rng = np.random.default_rng(seed)
    starts = [point(*STARTS[0])]
    for _ in range(options["starts"] - 1):
        z_max = np.exp(rng.uniform(np.log(0.05), np.log(3)))
        starts.append(point(z_max, rng.uniform(0, 1), rng.uniform(1.0, min(options["n_max"], 3.0))))
    seen = data.u[: data.train.stop]  # later rows do not affect the training rows
    return build(_operator(seen, searched, tuple(starts)), data, options, progress, dynamics=False)


def g0_bouc_wen(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit the model; return graph, number of parameters, further results (see `template.build`)."""
    starts, seen = tuple(point(*values) for values in STARTS), data.u[: data.train.stop]
    return build(_operator(seen, variables(options["n_max"]), starts), data, options, progress)


KINDS = {
    "bouc_wen": Row(
        "Bouc-Wen operator as a grey box, nonlinear least squares",
        bouc_wen,
        (
            Option("starts", 6, 1, 1000, text="number of start values of the search"),
            N_MAX,
            Option("z0", None, -1.0, 1.0, text="z at the first row, as a fraction of its bound; default: fitted"),
            DEAD_BAND,
        ),
        (Candidate(OPENS, 0.2, 0.4, quick={"starts": 1}),),
    ),
    "g0_bouc_wen": Row(
        "Bouc-Wen hysteresis, then G0(s) with delay, variable projection",
        g0_bouc_wen,
        (N_MAX, *DYNAMICS_OPTIONS),
        (Candidate(LATE, 0.5, 0.4),),
        Memory(1000.0),
    ),
}
