"""Bouc-Wen operator in parallel with a static curve and lags, which represent a spring, a dashpot and creep.

  y = c + f(x) + sum_l k_l L_{T_l}[x] + b z + sum_l m_l L_{T_l}[z],   z = z[x; beta, gamma, n],  x = scaled u

f is a polynomial, and L_T is a first-order lag. For a short T, the difference x - L_T[x] is the speed times T, as in a
dashpot. With n = 1 and gamma = 0, z is a relaxation state; such a state in parallel with a curve describes the
open-circuit voltage of a battery (Plett 2004).

In the damper of Spencer et al. 1997, a dashpot is also in series with z. Then z depends on the displacement d between
the piston and this dashpot, and the force of z moves the dashpot:

  y = c + f(x) + sum_l k_l L_{T_l}[x] + b z + a (d - x),   z = z[d; beta, gamma, n],   d' = x' - d/T - r z

The four parameters of z, and T and r, are searched. All other parameters are linear and are computed by least squares
for each trial (variable projection, Golub & Pereyra 1973). The degree of f, the use of lags and the use of the dashpot
in series are chosen by the error on validation blocks inside the training rows.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike

from hystfmu.base import Array, Indices, Progress
from hystfmu.data import Dataset
from hystfmu.data.reversals import reversals
from hystfmu.graph import Graph, Node, Value
from hystfmu.identify.catalogue import OPENS, Built, Candidate, Memory, Option, Options, Row, device, scaled_input
from hystfmu.identify.cuts import fitted_and_held
from hystfmu.identify.estimate.objective import Linear, Objective
from hystfmu.identify.estimate.template import bounded, limits
from hystfmu.identify.excitation.minor_loops import SPEEDS
from hystfmu.identify.features.bent_chain import dead_zones
from hystfmu.identify.methods.bouc_wen import point, shape, variables
from hystfmu.identify.solvers.trust_region import Coordinates, refined
from hystfmu.model import rms, run_along

TEXT = "Bouc-Wen operator with a curve, lags and dashpots: spring, damper, creep"
DEGREES = (1, 3, 5, 8, 12)  # degrees of the curve that are tried
LAGS = 6
BETTER = 0.95  # ratio of validation errors below which a component is kept
STEPS, LONG = 4.0, 10.0  # shortest time of the dashpot in steps, longest one in record lengths
DASHPOT = slice(4, 6)  # search variables of the dashpot in series
STARTS = ((0.5, 0.5, 1.5), (0.1, 0.2, 1.0), (2.0, 0.2, 1.0))  # start values of z_max, gamma / (beta + gamma), n
EVALUATIONS = (20, 100)  # maximum number of evaluations of residuals and Jacobian: of a trial, of the last fit
TOLERANCE = 1e-8  # relative change that ends a search
MOST_ROWS = 6000  # maximum number of rows of a fit; the operator runs over all rows, which are then thinned evenly

CANDIDATES = (Candidate(OPENS, 0.3, 0.6),)
OPTIONS = (
    Option("n_max", 6.0, 1.0, 20.0, text="largest exponent n tried"),
    Option("degree", None, 1, 20, text="degree of the curve; default: chosen on validation blocks"),
    Option("rate", None, choices=("yes", "no"), text="whether there are lags; default: chosen on validation blocks"),
    Option("series", None, choices=("yes", "no"), text="dashpot in series with the operator; default: as for rate"),
)


@dataclass(frozen=True)
class Parts:
    """Structure and shape of a model: degree of the curve, time constants of the lags (s), search variables p of z.

    The elements of p are ln z_max, gamma / (beta + gamma), n, z0 / z_max, and with a dashpot in series ln T and ln r.
    """

    degree: int
    T: tuple[float, ...]
    p: Array

    @property
    def in_series(self) -> bool:
        """True if a dashpot is in series with z."""
        return len(self.p) > DASHPOT.start

    def graph(self, scaling: Node, data: Dataset) -> tuple[Graph, tuple[Linear, ...]]:
        """Return the graph with a polynomial as the block ``spring``, and its linear parameters.

        The dashpot in series breaks the loop: its output is a state.
        """
        first = float((scaling.value("gain") * data.u[0] + scaling.value("offset"))[0])
        nodes = [scaling, Node("operator", "bouc_wen", {}, {"A": 1.0, "u0": first, "alpha": 0.0, "k": 1.0})]
        wires, ends = [("input.y", "operator.u")], ["operator.z"]
        if self.in_series:
            nodes[1:1] = [
                Node("series", "creep", {}, {"w": 1.0, "start": "rest"}),
                Node("between", "sum", {"n": 2}, {"k": [1.0, 1.0]}),
            ]
            nodes.append(Node("force", "sum", {"n": 2}, {"k": [-1.0, -1.0]}))
            wires = [("input.y", "between.u[1]"), ("series.y", "between.u[2]"), ("between.y", "operator.u")]
            wires += [("input.y", "force.u[1]"), ("operator.z", "force.u[2]"), ("force.y", "series.u")]
            ends.append("series.y")
        linear = [Linear("readout.k", tuple(range(len(ends))))]
        size = {"n_u": 1, "n_f": 0, "n_y": 0, "n_k": 0, "q": self.degree}
        others = [(Node("spring", "polynomial_narx", size), "input.y", "theta")]
        # a dashpot in series takes the place of the lags of z
        for name, source in {"dashpot": "input.y", **({} if self.in_series else {"late": "operator.z"})}.items():
            if self.T:
                lags: dict[str, Value] = {"w": np.zeros(len(self.T)), "T": self.T, "start": "steady"}
                others.append((Node(name, "creep", {}, lags), source, "w"))
        for node, source, weights in others:
            nodes.append(node)
            wires.append((source, f"{node.name}.u"))
            ends.append(f"{node.name}.y")
            linear.append(Linear(f"{node.name}.{weights}", tuple(range(node.sizes[weights]))))
        wires += [(end, f"readout.u[{i}]") for i, end in enumerate(ends, 1)]
        nodes.append(Node("readout", "sum", {"n": len(ends)}, {"k": np.ones(len(ends))}))
        # only the dashpot in series uses a value of the last step
        return device(data, nodes, wires, sort=False), tuple(linear)


def values(p: Array) -> dict[str, ArrayLike]:
    """Return the parameters of the operator and of its dashpot for the search variables p."""
    found: dict[str, ArrayLike] = {**shape(p)}
    if len(p) > DASHPOT.start:
        T, r = map(float, np.exp(p[DASHPOT]))
        found |= {"series.T": T, "force.k": np.array([-1.0, -r * T])}
    return found


class _Fitting:
    """Data set with its validation blocks and the bounds of a search, and methods that fit a model structure to it."""

    def __init__(self, data: Dataset, options: Options) -> None:
        # a polynomial of high degree is not valid outside the range of the rows to which it is fitted
        self.data, self.scaling = data, scaled_input(data.u[data.counted])[0]
        self.all, self.kept, self.held = fitted_and_held(data, MOST_ROWS)
        self.variables = variables(options["n_max"])
        self.seconds = (data.train.stop - data.train.start) * data.h
        least, most = STEPS * data.h, LONG * self.seconds
        ends = np.log([[least, most], [1 / most, 1 / least]]).T  # of T and r of the dashpot
        lo, hi, scale = limits(self.variables)
        self.lo, self.hi, self.scale = np.append(lo, ends[0]), np.append(hi, ends[1]), np.append(scale, [0.3, 0.3])

    def fit(self, parts: Parts, rows: Indices, evaluations: int) -> tuple[Parts, Graph, int]:
        """Fit a structure to `rows`; return it with its search variables, its graph, and the number of parameters."""
        n, (graph, linear) = len(parts.p), parts.graph(self.scaling, self.data)
        coordinates = Coordinates(self.lo[:n], self.hi[:n], self.scale[:n], values)
        objective = Objective(self.data, graph, coordinates, linear, rows=rows)
        p = refined(objective, parts.p, evaluations, TOLERANCE).p
        return replace(parts, p=p), objective.graph(p), n + len(objective.positive)

    def tried(self, parts: Parts) -> tuple[float, Parts]:
        """Fit a structure outside the validation blocks; return the RMS error on these blocks and the fit."""
        found, graph, _ = self.fit(parts, self.kept, EVALUATIONS[0])
        return rms((run_along(graph, self.data) - self.data.y)[self.held]), found

    def in_series(self, parts: Parts) -> list[Parts]:
        """Return start points with a dashpot in series: with the shape of z of `parts`, and with its default shape."""
        turns = max(len(reversals(self.data.u[self.data.train])), 1)
        dashpot = np.log([self.seconds, turns / self.seconds])
        return [replace(parts, p=np.append(p, dashpot)) for p in (parts.p, point(*STARTS[0]))]


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit the model of the module docstring; return graph, number of parameters, further results."""
    f = _Fitting(data, options)
    longest = max((data.train.stop - data.train.start) * data.h / 3, 10 * data.h)
    every = tuple(float(T) for T in np.geomspace(2 * data.h, longest, LAGS))
    T = every if options["rate"] == "yes" else ()
    starts = [point(*start) for start in STARTS]
    # with a curve of too low degree, the search of z can end at a bound: it begins with a high degree
    first = int(options["degree"] or DEGREES[-2])
    best = min((f.tried(Parts(first, T, p)) for p in starts), key=lambda t: t[0])
    progress(0.4)
    if options["rate"] is None and _several_durations(data):  # with one duration, lags and loop cannot be separated
        more = min((f.tried(Parts(first, every, p)) for p in (best[1].p, starts[0])), key=lambda t: t[0])
        best = more if more[0] < BETTER * best[0] else best
    if options["series"] == "yes" or (options["series"] is None and best[1].T):
        more = min(map(f.tried, f.in_series(best[1])), key=lambda t: t[0])
        best = more if options["series"] == "yes" or more[0] < BETTER * best[0] else best
    progress(0.6)
    if options["degree"] is None:
        more = f.tried(replace(best[1], degree=DEGREES[-1]))
        best = more if more[0] < BETTER * best[0] else best
        for degree in [d for d in DEGREES[::-1] if d < best[1].degree]:
            less = f.tried(replace(best[1], degree=degree))
            if not less[0] * BETTER < best[0]:
                break
            best = less
    progress(0.8)
    parts, graph, count = f.fit(best[1], f.all, EVALUATIONS[1])
    told = {"parts": _named(parts), "bounded": bounded(f.variables, parts.p[: len(f.variables)])}
    theta = graph.node("spring").value("theta")
    slope, r, weights, at_0 = dead_zones(legendre.poly2leg(np.append(theta[-1], theta[:-1])))
    graph = graph.replace(Node("spring", "dead_zones", {"n": len(r)}, {"w0": slope, "r": r, "w": weights}))
    return graph.replace(graph.node("readout").with_values(offset=at_0)), count, told


def _several_durations(data: Dataset) -> bool:
    """Return whether the 90th percentile of the durations of half cycles is more than twice the 10th percentile.

    The speeds of the input are not a suitable test, because a decaying sine has many speeds but only one frequency.
    """
    lasting = np.diff(reversals(data.longest().u[data.longest().train]))
    long, short = np.percentile(lasting, [90, 10]) if len(lasting) else (1.0, 1.0)
    return bool(long > SPEEDS * short)


def _named(parts: Parts) -> str:
    words = [f"curve of degree {parts.degree}"] if parts.degree > 1 else []
    words += [f"{len(parts.T)} lags"] if parts.T else []
    return ", ".join(["Bouc-Wen", *words, *(["dashpot in series"] if parts.in_series else [])])


KINDS = {"bouc_wen_parallel": Row(TEXT, build, OPTIONS, CANDIDATES, Memory(1200.0))}
