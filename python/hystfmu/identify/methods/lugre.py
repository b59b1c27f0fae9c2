"""LuGre friction over a displacement u, beside a spring: the force of bristles with a Stribeck curve.

  y = c + k u + sigma_0 z + sigma_1 z' + sigma_2 u',   z' = u' - |u'| z / d(u'),
  d(v) = d_c + (d_s - d_c) e^(-(v/v_s)^2)

(Canudas de Wit et al. 1995, with d = g / sigma_0). The shape of z is searched: the deflections d_c and d_s at which the
bristles slide, the Stribeck velocity v_s, and the initial z. All other parameters are linear and are computed by least
squares for each trial (variable projection, Golub & Pereyra 1973). u is a ramp between rows.
"""

from itertools import product

import numpy as np

from hystfmu.base import Array, Progress
from hystfmu.data import Dataset
from hystfmu.graph import Node
from hystfmu.identify.catalogue import LATE, Built, Candidate, Option, Options, Row, device
from hystfmu.identify.estimate.objective import Linear, Objective, determined, search
from hystfmu.identify.estimate.template import Variable, bounded, limits
from hystfmu.identify.solvers.trust_region import Coordinates

TEXT = "LuGre friction over a displacement, beside a spring, variable projection"
DEFLECTIONS, SPEEDS = (0.02, 0.1, 0.005), (0.1, 0.02)  # start values of d_c and v_s
SEARCHED = (  # lengths relative to the span of u, speeds relative to its largest speed
    Variable("ln d_c", np.log(1e-4), np.log(10.0), 0.3),
    Variable("ln d_s / d_c", -1.0, 3.0, 0.2),
    Variable("ln v_s", np.log(1e-4), np.log(10.0), 0.3),
    Variable("", -1.0, 1.0, 0.3),
)


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit the block ``lugre``, to whose output the force of a spring is added.

    The function returns the graph, the number of its parameters, and further results: the searched shape, and the value
    and the standard error of each free parameter.
    """
    seen = data.u[: data.train.stop]  # later rows do not affect the training rows
    span, fastest = float(np.ptp(seen)), float(np.abs(np.diff(seen)).max()) / data.h

    def values(p: Array) -> dict[str, float]:
        d_c, d_s, v_s = span * np.exp(p[0]), span * np.exp(p[0] + p[1]), fastest * np.exp(p[2])
        found = {"d_c": d_c, "d_s": d_s, "v_s": v_s, "z0": p[3] * d_s}
        return {f"friction.{name}": float(value) for name, value in found.items()}

    nodes = [Node("friction", "lugre"), Node("readout", "sum", {"n": 2})]
    graph = device(data, nodes, [("friction.y", "readout.u[2]")], ("friction.u", "readout.u[1]"))
    sigma = [Linear(f"friction.sigma_{i}") for i in range(3)]
    linear = [*sigma, Linear("readout.k"), Linear("readout.offset")]
    objective = Objective(data, graph, Coordinates(*limits(SEARCHED), values), linear)
    pairs = list(product(SPEEDS, DEFLECTIONS))[: options["starts"]]
    p = search(objective, [np.array([np.log(d), 0.2, np.log(v), 0.0]) for v, d in pairs], progress).p
    found = {"bounded": bounded(SEARCHED, p), "free": determined(objective, p).table}
    return objective.graph(p), len(p) + len(linear), found


KINDS = {
    "lugre": Row(
        TEXT,
        build,
        (Option("starts", 6, 1, 6, text="number of start values of the search"),),
        (Candidate(LATE, 0.3, 0.4, quick={"starts": 1}),),
        records=True,
    )
}
