"""Modified Bouc-Wen model of a magnetorheological damper over a displacement u, beside a spring.

  y = c + k u +- c_1 w',   c_1 w' = alpha z + k_0 d + c_0 d',   d = u - w,
  z' = d' - gamma |d'| |z|^(n-1) z - beta d' |z|^n

(Spencer et al. 1997). An operator, a spring and a dashpot in parallel are in series with the dashpot c_1. A is 1,
because only the product alpha z has an effect. The ratios of c_0, k_0 and alpha to c_1, the shape of z and the initial
z are searched. The scale of the force, k and c are linear and are computed by least squares for each trial (variable
projection, Golub & Pereyra 1973). u is a ramp between rows. The first row of a record does not count, because its
velocity is not known.
"""

import numpy as np

from hystfmu.base import Array, Progress
from hystfmu.data import Dataset
from hystfmu.data.reversals import reversals
from hystfmu.graph import Node
from hystfmu.identify.catalogue import LATE, Built, Candidate, Options, Row, device
from hystfmu.identify.estimate.objective import Linear, Objective, determined
from hystfmu.identify.estimate.template import Variable, bounded, limits
from hystfmu.identify.solvers.trust_region import Coordinates, refined

TEXT = "Modified Bouc-Wen model of a magnetorheological damper, beside a spring, variable projection"
# start values of SEARCHED; the search found 16 of 16 random dampers from this point
START = np.array([np.log(0.05), np.log(0.1), np.log(3.0), np.log(0.1), 0.5, 2.0, 0.0])
EVALUATIONS, TOLERANCE = 50, 1e-7  # limits of the search
NONE = np.log(1e-9)  # a spring or a dashpot parallel to the operator may be absent
SEARCHED = (  # lengths relative to the span of u, rates relative to the mean rate of reversals
    Variable("ln c_0 / c_1", np.log(1e-6), np.log(1e3), 0.5, told=NONE),
    Variable("ln k_0 / c_1", np.log(1e-6), np.log(1e3), 0.5, told=NONE),
    Variable("ln alpha / c_1", np.log(1e-6), np.log(1e3), 0.3),
    Variable("ln z_max", np.log(1e-4), np.log(10.0), 0.3),
    Variable("gamma / (beta + gamma)", 0.0, 5.0, 0.1),
    Variable("n", 1.0, 6.0, 0.3, told=0.0),
    Variable("", -1.0, 1.0, 0.3),
)
SIZE = Variable("", -np.inf, np.inf, 0.1)  # ln c_1


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit the block ``modified_bouc_wen``, to whose output the force of a spring is added.

    The function returns the graph, the number of its parameters, and further results: the searched values that are at a
    bound, and the value and the standard error of each free parameter.
    """
    seen = data.u[: data.train.stop]  # later rows do not affect the training rows
    rows = np.setdiff1d(np.arange(len(data.u))[data.counted], data.starts)
    span, rate = float(np.ptp(seen)), max(len(reversals(seen)), 1) / (len(seen) * data.h)

    def values(p: Array) -> dict[str, float]:
        c_1 = float(np.exp(p[len(SEARCHED)])) if len(p) > len(SEARCHED) else 1.0
        ratio = np.exp(p[:3]) * [1.0, rate, rate]
        z_max, share, n = span * np.exp(p[3]), p[4], p[5]
        found = dict(zip(("c_1", "c_0", "k_0", "alpha"), c_1 * np.append(1.0, ratio), strict=True))
        found |= {"gamma": share / z_max**n, "beta": (1 - share) / z_max**n, "n": n, "z0": p[6] * z_max}
        return {f"damper.{name}": float(value) for name, value in found.items()}

    def objective(sign: float | None) -> Objective:
        """Return the search without c_1 and with the scale of the force, or the search with c_1 for a known sign."""
        searched = SEARCHED if sign is None else (*SEARCHED, SIZE)
        nodes = [
            Node("damper", "modified_bouc_wen", {}, {"A": 1.0, "k_1": 0.0}),
            Node("readout", "sum", {"n": 2}, {"k": [sign or 1.0, 1.0]}),
        ]
        graph = device(data, nodes, [("damper.y", "readout.u[1]")], ("damper.u", "readout.u[2]"))
        linear = [Linear("readout.k", (0, 1) if sign is None else (1,)), Linear("readout.offset")]
        return Objective(data, graph, Coordinates(*limits(searched), values), linear, rows=rows)

    ratios = objective(None)
    p = refined(ratios, START, EVALUATIONS, TOLERANCE).p
    size = float(ratios.project(p)[1][0])
    whole, q = objective(1.0 if size > 0 else -1.0), np.append(p, np.log(max(abs(size), 1e-100)))
    found = {"bounded": bounded(SEARCHED, p), "free": determined(whole, q).table}
    return whole.graph(q), len(q) + 2, found


KINDS = {"modified_bouc_wen": Row(TEXT, build, (), (Candidate(LATE, 0.4, 1.0),), records=True)}
