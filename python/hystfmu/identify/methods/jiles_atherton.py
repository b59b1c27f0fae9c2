"""Jiles-Atherton hysteresis followed by linear dynamics with delay, for magnetostrictive and magnetic devices.

  y = c + e^(-s tau) G0(s) (b_1 x + b_2 M + b_3 M^2),   M = M[x; a, k, c, alpha],   x = (u - bias) / scale

M is the magnetisation, relative to the saturation magnetisation (Ms = 1; Jiles & Atherton 1986). Its scale is contained
in the factors b. M starts from the demagnetised state. The term with M^2 describes the strain of a magnetostrictive rod
(Jiles 1995, J. Phys. D 28, 1537). Without the option `strain`, the term is used only if it reduces the error on
validation blocks. The loops are symmetric about the bias, a field that a magnet or a mean current adds to the field of
u. Eddy currents delay M like a first-order lag, which G0 represents with a large damping ratio. The module `template`
contains the search.
"""

import numpy as np

from hystfmu.base import Array, Progress, silent
from hystfmu.data import Dataset
from hystfmu.graph import Node
from hystfmu.identify.catalogue import LATE, Built, Candidate, Memory, Option, Options, Row, scaled_input
from hystfmu.identify.cuts import fitted_and_held
from hystfmu.identify.estimate.dynamics import DYNAMICS_OPTIONS
from hystfmu.identify.estimate.template import Template, Variable, build
from hystfmu.model import rms, run_along

SEARCHED = (  # for u relative to half of its range
    Variable("ln a", -4.0, 1.0, 0.2),
    Variable("ln k", -5.0, 1.0, 0.2),
    Variable("c", 0.0, 0.95, 0.1),
    Variable("alpha Ms / (3 a)", -0.5, 0.95, 0.1),
    Variable("bias", -2.0, 2.0, 0.05),
)
# values of a, k, c and alpha Ms / (3 a)
STARTS = ((0.25, 0.2, 0.2, 0.2), (0.1, 0.05, 0.2, 0.2), (0.7, 0.5, 0.2, 0.2))
BANK = tuple((a, k, 0.1, 0.2) for a in (0.1, 0.3, 0.9) for k in (0.03, 0.12, 0.5))
BETTER = 0.9  # ratio of validation errors below which the term with M^2 is kept


def g0_jiles_atherton(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit the model; return graph, number of parameters, further results.

    The further results are those of `template.build`, and the list ``parts`` of the terms.
    """
    strain = options["strain"]
    if strain is None:
        strain = "yes" if _squares(data, options) else "no"
    graph, parameters, found = build(_operator(data, strain == "yes"), data, options, progress)
    return graph, parameters, {**found, "parts": ["M", "M^2"] if strain == "yes" else ["M"]}


def _squares(data: Dataset, options: Options) -> bool:
    """Return whether the term with M^2 reduces the error on validation blocks."""
    tested = fitted_and_held(data, len(data.u))[2]
    held = np.zeros(len(data.u), dtype=bool) if data.held is None else data.held.copy()
    held[tested] = True
    part = data.with_held(held)
    fits = [build(_operator(part, strain), part, options, silent)[0] for strain in (False, True)]
    without, better = (rms((run_along(graph, data) - data.y)[tested]) for graph in fits)
    return better < BETTER * without


def _operator(data: Dataset, strain: bool) -> Template:
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
        SEARCHED,
        ("input.y", "operator.y", "square.y") if strain else ("input.y", "operator.y"),
        tuple(at(*start) for start in STARTS),
        tuple(at(*start) for start in BANK),
        (("operator.y", "square.u[1]"), ("operator.y", "square.u[2]")) if strain else (),
    )


KINDS = {
    "g0_jiles_atherton": Row(
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
