"""Bouc-Wen hysteresis followed by linear dynamics with delay: y = c + e^(-s tau) G0(s) (a u + b z(u; beta, gamma, n)).

The operator is that of the kind `bouc_wen` (A = 1), and the dynamics are those of `g0_prandtl_ishlinskii`. The module
`operator_dynamics` contains the search.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array, Progress
from hystfmu.data import Dataset
from hystfmu.identify.catalogue import LATE, Built, Candidate, Memory, Option, Options
from hystfmu.identify.estimate import operator_dynamics
from hystfmu.identify.estimate.dynamics import DYNAMICS_OPTIONS
from hystfmu.identify.methods import bouc_wen

TEXT = "Bouc-Wen hysteresis, then G0(s) with delay, variable projection"
MEMORY = Memory(1000.0)
BANK = tuple((z_max, share, n) for z_max in (0.1, 0.3, 1.0, 3.0) for share in (0.0, 0.5) for n in (1.0, 2.0))
STARTS = ((0.5, 0.5, 1.5), (0.15, 0.2, 1.2), (2.0, 0.5, 1.5))  # start values of z_max, gamma / (beta + gamma), n

CANDIDATES = (Candidate(LATE, 0.5, 0.4),)
OPTIONS = (Option("n_max", 6.0, 1.0, 20.0, text="largest exponent n tried"), *DYNAMICS_OPTIONS)


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit the model; return graph, number of parameters, further results (see `operator_dynamics.build`)."""
    operator = operator_dynamics.Operator(
        bouc_wen.nodes(data),
        bouc_wen.shape,
        *bouc_wen.limits(options["n_max"]),
        ("input.y", "operator.z"),
        tuple(_point(*shape) for shape in STARTS),
        tuple(_point(*shape) for shape in BANK),
        bouc_wen.searched,
    )
    return operator_dynamics.build(operator, data, options, progress)


def _point(z_max: float, share: float, n: float) -> Array:
    return np.array([np.log(z_max), share, n, 0.0])
