"""Operators with a searched shape, alone or followed by linear dynamics with delay: Bouc-Wen and Jiles-Atherton.

bouc_wen           y = c + a u + b z(u; beta, gamma, n), for loops that a sum of plays cannot represent
                   (Wen 1976; Ikhouane & Rodellar 2007)
g0_bouc_wen        y = c + e^(-s tau) G0(s) (a u + b z(u; beta, gamma, n))
g0_jiles_atherton  y = c + e^(-s tau) G0(s) (b_1 x + b_2 M + b_3 M^2), M = M[x; a, k, c, alpha], x = (u - bias) / scale

The module `template` contains the search. Linear least squares gives the offset and the weights for each trial.

Bouc-Wen. A change of A has no effect on y if beta, gamma and the weight b are changed, too. A = 1 removes this
redundancy. The slope of z is then 1 at z = 0. The search variables are the limit z_max = (beta + gamma)^(-1/n) of |z|,
the ratio gamma / (beta + gamma), the exponent n, and the initial value of z.

Jiles-Atherton. M is the magnetisation, relative to the saturation magnetisation (Ms = 1; Jiles & Atherton 1986). Its
scale is contained in the factors b. M starts from the demagnetised state. The term with M^2 describes the strain of a
magnetostrictive rod (Jiles 1995, J. Phys. D 28, 1537). Without the option `strain`, the term is used only if it reduces
the error on validation blocks. The loops are symmetric about the bias, a field that a magnet or a mean current adds to
the field of u. Eddy currents delay M like a first-order lag, which G0 represents with a large damping ratio.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array, Progress, silent
from hystfmu.data import Dataset
from hystfmu.graph import Node
from hystfmu.identify.catalogue import LATE, OPENS, Built, Candidate, Kind, Memory, Option, Options
from hystfmu.identify.cuts import fitted_and_held
from hystfmu.identify.estimate.dynamics import DYNAMICS_OPTIONS
from hystfmu.identify.estimate.template import Template, Variable, build
from hystfmu.identify.features.plays import DEAD_BAND
from hystfmu.identify.graphs import scaled_input
from hystfmu.model import run_along
from hystfmu.model.accuracy import rms

N_MAX = Option("n_max", 6.0, 1.0, 20.0, text="largest exponent n tried")
# values of z_max, gamma / (beta + gamma) and n: starts of the search, and operators with fixed shapes
BOUC_WEN_STARTS = ((0.5, 0.5, 1.5), (0.15, 0.2, 1.2), (2.0, 0.5, 1.5))
BOUC_WEN_BANK = tuple((z_max, share, n) for z_max in (0.1, 0.3, 1.0, 3.0) for share in (0.0, 0.5) for n in (1.0, 2.0))

MAGNETIC = (  # for u relative to half of its range
    Variable("ln a", -4.0, 1.0, 0.2),
    Variable("ln k", -5.0, 1.0, 0.2),
    Variable("c", 0.0, 0.95, 0.1),
    Variable("alpha Ms / (3 a)", -0.5, 0.95, 0.1),
    Variable("bias", -2.0, 2.0, 0.05),
)
# values of a, k, c and alpha Ms / (3 a)
MAGNETIC_STARTS = ((0.25, 0.2, 0.2, 0.2), (0.1, 0.05, 0.2, 0.2), (0.7, 0.5, 0.2, 0.2))
MAGNETIC_BANK = tuple((a, k, 0.1, 0.2) for a in (0.1, 0.3, 0.9) for k in (0.03, 0.12, 0.5))
BETTER = 0.9  # ratio of validation errors below which the term with M^2 is kept


# ---- Bouc-Wen --------------------------------------------------------------------------------------------------------
def bouc_wen_variables(n_max: float) -> tuple[Variable, ...]:
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


def _bouc_wen(data: Dataset, variables: tuple[Variable, ...], starts: tuple[Array, ...]) -> Template:
    scaling, gain, offset = scaled_input(data.u[: data.train.stop])  # later rows do not affect the training rows
    first = gain * float(data.u[0]) + offset
    operator = Node("operator", "bouc_wen", {}, {"A": 1.0, "alpha": 0.0, "k": 1.0, "u0": first})
    bank = tuple(point(*values) for values in BOUC_WEN_BANK)
    return Template([scaling, operator], shape, variables, ("input.y", "operator.z"), starts, bank)


def point(z_max: float, share: float, n: float) -> Array:
    """Return the search variables of a Bouc-Wen operator whose initial z is 0."""
    return np.array([np.log(z_max), share, n, 0.0])


def bouc_wen(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit the graph ``(scaling, bouc_wen) -> sum``; return graph, number of parameters, further results."""
    variables = bouc_wen_variables(options["n_max"])
    if options["z0"] is not None:
        variables = (*variables[:3], Variable("", options["z0"] - 1e-9, options["z0"] + 1e-9, 0.3))
    rng = np.random.default_rng(seed)
    starts = [point(*BOUC_WEN_STARTS[0])]
    for _ in range(options["starts"] - 1):
        z_max = np.exp(rng.uniform(np.log(0.05), np.log(3)))
        starts.append(point(z_max, rng.uniform(0, 1), rng.uniform(1.0, min(options["n_max"], 3.0))))
    return build(_bouc_wen(data, variables, tuple(starts)), data, options, progress, dynamics=False)


def g0_bouc_wen(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit the model; return graph, number of parameters, further results (see `template.build`)."""
    starts = tuple(point(*values) for values in BOUC_WEN_STARTS)
    return build(_bouc_wen(data, bouc_wen_variables(options["n_max"]), starts), data, options, progress)


# ---- Jiles-Atherton --------------------------------------------------------------------------------------------------
def g0_jiles_atherton(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit the model; return graph, number of parameters, further results.

    The further results are those of `template.build`, and the list ``parts`` of the terms.
    """
    strain = options["strain"]
    if strain is None:
        strain = "yes" if _squares(data, options) else "no"
    graph, parameters, found = build(_jiles_atherton(data, strain == "yes"), data, options, progress)
    return graph, parameters, {**found, "parts": ["M", "M^2"] if strain == "yes" else ["M"]}


def _squares(data: Dataset, options: Options) -> bool:
    """Return whether the term with M^2 reduces the error on validation blocks."""
    tested = fitted_and_held(data, len(data.u))[2]
    held = np.zeros(len(data.u), dtype=bool) if data.held is None else data.held.copy()
    held[tested] = True
    part = data.with_held(held)
    fits = [build(_jiles_atherton(part, strain), part, options, silent)[0] for strain in (False, True)]
    without, better = (rms((run_along(graph, data) - data.y)[tested]) for graph in fits)
    return better < BETTER * without


def _jiles_atherton(data: Dataset, strain: bool) -> Template:
    """Return the Jiles-Atherton operator for the search, with a term M^2 if `strain` is True."""
    scaling, _, offset = scaled_input(data.u[: data.train.stop])  # later rows do not affect the training rows

    def values(p: Array) -> dict[str, float]:
        a, k = float(np.exp(p[0])), float(np.exp(p[1]))
        found = {"a": a, "k": k, "c": float(p[2]), "alpha": 3 * a * float(p[3])}
        return {"input.offset": offset - float(p[4]), **{f"operator.{name}": value for name, value in found.items()}}

    def at(a: float, k: float, c: float, share: float) -> Array:
        # the start value of the bias is the middle of u if u has mostly one sign, otherwise 0
        return np.array([np.log(a), np.log(k), c, share, 0.0 if abs(offset) > 0.5 else offset])

    square = [Node("square", "product", {"n": 2, "m": 0})] if strain else []
    return Template(
        [scaling, Node("operator", "jiles_atherton", {}, {"Ms": 1.0}), *square],
        values,
        MAGNETIC,
        ("input.y", "operator.y", "square.y") if strain else ("input.y", "operator.y"),
        tuple(at(*start) for start in MAGNETIC_STARTS),
        tuple(at(*start) for start in MAGNETIC_BANK),
        (("operator.y", "square.u[1]"), ("operator.y", "square.u[2]")) if strain else (),
    )


KINDS = {
    "bouc_wen": Kind(
        "Bouc-Wen operator as a grey box, nonlinear least squares",
        bouc_wen,
        (
            Option("starts", 6, 1, 1000, text="start values of the search"),
            N_MAX,
            Option("z0", None, -1.0, 1.0, text="z at the first row, as a fraction of its bound; default: fitted"),
            DEAD_BAND,
        ),
        (Candidate(OPENS, 0.2, 0.4, quick={"starts": 1}),),
    ),
    "g0_bouc_wen": Kind(
        "Bouc-Wen hysteresis, then G0(s) with delay, variable projection",
        g0_bouc_wen,
        (N_MAX, *DYNAMICS_OPTIONS),
        (Candidate(LATE, 0.5, 0.4),),
        Memory(1000.0),
    ),
    "g0_jiles_atherton": Kind(
        "Jiles-Atherton hysteresis about a bias, then G0(s) with delay, variable projection",
        g0_jiles_atherton,
        (
            Option(
                "strain",
                None,
                choices=("no", "yes"),
                text="part of y with M^2, for magnetostriction; default: chosen on validation blocks",
            ),
            *DYNAMICS_OPTIONS,
        ),
        (
            Candidate(LATE, 0.5, 1.0, options={"strain": "no"}),
            Candidate(LATE, 0.5, 1.2, options={"strain": "yes"}),
        ),
        Memory(1000.0),
    ),
}
