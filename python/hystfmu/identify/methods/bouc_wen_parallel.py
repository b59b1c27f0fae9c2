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

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import legendre

from hystfmu.base.arrays import Array, Progress
from hystfmu.data import Dataset
from hystfmu.data.dataset import Rows
from hystfmu.data.reversals import reversals
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.graph.recursion import lag
from hystfmu.identify.catalogue import OPENS, Built, Candidate, Memory, Option, Options, Row
from hystfmu.identify.cuts import fitted_and_held
from hystfmu.identify.estimate.template import bounded, limits
from hystfmu.identify.excitation.minor_loops import SPEEDS
from hystfmu.identify.features.bent_chain import dead_zones
from hystfmu.identify.graphs import device, scaled_input
from hystfmu.identify.methods.bouc_wen import point, shape, variables
from hystfmu.identify.solvers.trust_region import Differences, refined
from hystfmu.model.accuracy import rms

TEXT = "Bouc-Wen operator with a curve, lags and dashpots: spring, damper, creep"
DEGREES = (1, 3, 5, 8, 12)  # degrees of the curve that are tried
LAGS = 6
BETTER = 0.95  # ratio of validation errors below which a component is kept
STEPS, LONG = 4.0, 10.0  # shortest time of the dashpot in steps, longest one in record lengths
DASHPOT = slice(4, 6)  # search variables of the dashpot in series
STARTS = ((0.5, 0.5, 1.5), (0.1, 0.2, 1.0), (2.0, 0.2, 1.0))  # start values of z_max, gamma / (beta + gamma), n
EVALUATIONS = (20, 100)  # maximum number of evaluations of residuals and Jacobian: of a trial, of the last fit
TOLERANCE = 1e-8  # relative change that ends a search
SMALL = 1e-9  # relative singular value below which a combination of columns is omitted
MOST_ROWS = 6000  # maximum number of rows of a fit; the operator runs over all rows, which are then thinned evenly

CANDIDATES = (Candidate(OPENS, 0.3, 0.6),)
OPTIONS = (
    Option("n_max", 6.0, 1.0, 20.0, text="largest exponent n tried"),
    Option("degree", None, 1, 20, text="degree of the curve; default: chosen on validation blocks"),
    Option("rate", None, choices=("yes", "no"), text="whether there are lags; default: chosen on validation blocks"),
    Option("series", None, choices=("yes", "no"), text="dashpot in series with the operator; default: as for rate"),
)


def operator(u: Array, p: Array, h: float) -> Array:
    """Return the columns of the operator for the scaled input u (rows,) and the step h (s): z, and d - u if any.

    The elements of p are ln z_max, gamma / (beta + gamma), n, z0 / z_max, and with a dashpot in series ln T and ln r.
    """
    nodes, wires, ends = hysteresis(p, float(u[0]))
    to, outputs = [b for a, b in wires if a == "input.y"], [Output(f"y{k}", end) for k, end in enumerate(ends)]
    graph = Graph(nodes, [w for w in wires if w[0] != "input.y"], [Input("u", tuple(to))], outputs, sort=False)
    return graph.run(u, h).reshape(len(u), -1)


def hysteresis(p: Array, u0: float) -> tuple[list[Node], list[tuple[str, str]], list[str]]:
    """Return the blocks of the operator with its dashpot, their wires, and the ends of the wires to the readout.

    u0 is the scaled input at which z has its initial value. The dashpot breaks the loop: its output is a state.
    """
    values = {name.partition(".")[2]: value for name, value in shape(p).items()}
    node = Node("operator", "bouc_wen", {}, {"A": 1.0, "u0": u0, **values, "alpha": 0.0, "k": 1.0})
    if len(p) == DASHPOT.start:
        return [node], [("input.y", "operator.u")], ["operator.z"]
    T, r = map(float, np.exp(p[DASHPOT]))
    nodes = [
        Node("series", "creep", {}, {"w": 1.0, "T": T, "start": "rest"}),
        Node("between", "sum", {"n": 2}, {"k": [1.0, 1.0]}),
        node,
        Node("force", "sum", {"n": 2}, {"k": [-1.0, -r * T]}),
    ]
    wires = [("input.y", "between.u[1]"), ("series.y", "between.u[2]"), ("between.y", "operator.u")]
    wires += [("input.y", "force.u[1]"), ("operator.z", "force.u[2]"), ("force.y", "series.u")]
    return nodes, wires, ["operator.z", "series.y"]


@dataclass(frozen=True)
class Parts:
    """Structure and shape of a model: degree of the curve, time constants of the lags (s), search variables p of z."""

    degree: int
    T: tuple[float, ...]
    p: Array

    @property
    def late(self) -> tuple[float, ...]:
        """Time constants of the lags of z: a dashpot in series takes their place."""
        return self.T if len(self.p) == DASHPOT.start else ()


class _Fitting:
    """Data set with its regressors and validation blocks, and methods that fit a model structure to it."""

    def __init__(self, data: Dataset, options: Options) -> None:
        # a polynomial of high degree is not valid outside the range of the rows to which it is fitted
        self.scaling, gain, offset = scaled_input(data.u[data.counted])
        self.data, self.x = data, gain * data.u[: data.train.stop] + offset
        self.all, self.kept, self.held = fitted_and_held(data, MOST_ROWS)
        self.variables = variables(options["n_max"])
        lo, hi, scale = limits(self.variables)
        seconds = (data.train.stop - data.train.start) * data.h
        of_dashpot = np.array([[STEPS * data.h, LONG * seconds], [1 / (LONG * seconds), 1 / (STEPS * data.h)]])
        self.seconds = seconds
        self.lo, self.hi = (np.append(v, w) for v, w in zip((lo, hi), np.log(of_dashpot).T, strict=True))
        self.scale = np.append(scale, [0.3, 0.3])

    def columns(self, parts: Parts) -> Array:
        """Return the regressors of a structure: polynomials of x, lags of x, z, the dashpot, and lags of z."""
        own = operator(self.x, parts.p, self.data.h)
        curve = legendre.legvander(np.clip(self.x, -1, 1), parts.degree)
        of_x, of_z = (
            [lag(self.data.h, T).run(v[:, None]) for T in some]
            for v, some in ((self.x, parts.T), (own[:, 0], parts.late))
        )
        return np.column_stack([curve, *of_x, own, *of_z])

    def project(self, parts: Parts, rows: Rows) -> tuple[Array, Array]:
        """Fit the regressors to y on `rows` by linear least squares; return residuals and coefficients."""
        columns = self.columns(parts)[rows]
        size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        c = np.linalg.lstsq(columns / size, self.data.y[rows], rcond=SMALL)[0] / size
        return np.asarray(columns @ c - self.data.y[rows]), c

    def fit(self, parts: Parts, rows: Rows, evaluations: int) -> Parts:
        """Search the parameters of z that minimise the error on `rows`."""

        def misfit(p: Array) -> Array:
            e = self.project(replace(parts, p=p), rows)[0]
            return np.asarray(e / (self.data.span * np.sqrt(len(e))))

        n = len(parts.p)
        found = refined(
            Differences(misfit, self.scale[:n], (self.lo[:n], self.hi[:n])), parts.p, evaluations, TOLERANCE
        )
        return replace(parts, p=found.p)

    def tried(self, parts: Parts) -> tuple[float, Parts]:
        """Fit a structure outside the validation blocks; return the RMS error on these blocks and the fit."""
        found = self.fit(parts, self.kept, EVALUATIONS[0])
        c = self.project(found, self.kept)[1]
        return rms(self.columns(found)[self.held] @ c - self.data.y[self.held]), found

    def in_series(self, parts: Parts) -> list[Parts]:
        """Return start points with a dashpot in series: with the shape of z of `parts`, and with its default shape."""
        turns = max(len(reversals(self.x[self.data.train])), 1)
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
    parts = f.fit(best[1], f.all, EVALUATIONS[1])
    c = f.project(parts, f.all)[1]
    told = {"parts": _named(parts), "bounded": bounded(f.variables, parts.p[: len(f.variables)])}
    return _graph(f, parts, c), len(c) + len(parts.p), told


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
    return ", ".join(["Bouc-Wen", *words, *(["dashpot in series"] if len(parts.p) > DASHPOT.start else [])])


def _graph(f: _Fitting, parts: Parts, c: Array) -> Graph:
    m, n = parts.degree + 1, len(parts.T)
    slope, r, weights, at_0 = dead_zones(c[:m])
    operator, wires, own = hysteresis(parts.p, float(f.x[0]))
    nodes = [f.scaling, *operator, Node("spring", "dead_zones", {"n": len(r)}, {"w0": slope, "r": r, "w": weights})]
    wires.append(("input.y", "spring.u"))
    k, ends = [1.0, *c[m + n : m + n + len(own)]], ["spring.y", *own]
    of_lags = c[m : m + n], c[m + n + len(own) :]
    for name, source, T, w in zip(
        ("dashpot", "late"), ("input.y", own[0]), (parts.T, parts.late), of_lags, strict=True
    ):
        if T:
            nodes.append(Node(name, "creep", {}, {"w": w, "T": np.array(T), "start": "steady"}))
            wires.append((source, f"{name}.u"))
            k, ends = [*k, 1.0], [*ends, f"{name}.y"]
    wires += [(end, f"readout.u[{i}]") for i, end in enumerate(ends, 1)]
    nodes.append(Node("readout", "sum", {"n": len(k)}, {"k": k, "offset": at_0}))
    return device(f.data, nodes, wires, sort=False)  # only the dashpot in series uses a value of the last step


KINDS = {"bouc_wen_parallel": Row(TEXT, build, OPTIONS, CANDIDATES, Memory(1200.0))}
