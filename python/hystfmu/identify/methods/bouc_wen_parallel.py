"""Bouc-Wen operator in parallel with a static curve and lags, which represent a spring, a dashpot and creep.

  y = c + f(x) + sum_l k_l L_{T_l}[x] + b z + sum_l m_l L_{T_l}[z],   z = z[x; beta, gamma, n],  x = scaled u

f is a polynomial, and L_T is a first-order lag. For a short T, the difference x - L_T[x] is the speed times T, as in a
dashpot. The damper of Spencer et al. 1997 has a spring and a dashpot in parallel with z. With n = 1 and gamma = 0, z is
a relaxation state; such a state in parallel with a curve describes the open-circuit voltage of a battery (Plett 2004).
Four parameters of z are searched. All other parameters are linear and are computed by least squares for each trial
(variable projection, Golub & Pereyra 1973). The degree of f and the use of lags are chosen by the error on validation
blocks inside the training rows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import legendre

from hystfmu.base.arrays import Array, Progress
from hystfmu.data import Dataset
from hystfmu.data.dataset import Rows
from hystfmu.data.reversals import reversals
from hystfmu.graph import Graph, Node, Value
from hystfmu.graph.recursion import lag
from hystfmu.identify.catalogue import OPENS, Built, Candidate, Kind, Memory, Option, Options
from hystfmu.identify.cuts import fitted_and_held
from hystfmu.identify.estimate.search import Differences, refined
from hystfmu.identify.estimate.template import bounded, limits
from hystfmu.identify.excitation.minor_loops import SPEEDS
from hystfmu.identify.features.bent_chain import dead_zones
from hystfmu.identify.graphs import device, scaled_input
from hystfmu.identify.methods.searched_operators import bouc_wen_variables, shape
from hystfmu.model.accuracy import rms

TEXT = "Bouc-Wen operator beside a curve and lags of the input: spring, dashpot, creep"
DEGREES = (1, 3, 5, 8, 12)  # degrees of the curve that are tried
LAGS = 6
BETTER = 0.95  # ratio of validation errors below which a component is kept
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
)


def operator(u: Array, p: Array) -> tuple[dict[str, float], Array]:
    """Return the parameters of the block ``bouc_wen``, and its state z (rows,) for the scaled input u (rows,).

    The elements of p are ln z_max, gamma / (beta + gamma), n and z0 / z_max.
    """
    values = {"A": 1.0, "u0": float(u[0]), **{k.partition(".")[2]: v for k, v in shape(p).items()}}
    return values, Graph.single(Node("z", "bouc_wen", {}, {**values, "alpha": 0.0, "k": 1.0})).run(u)[:, 1]


@dataclass(frozen=True)
class Parts:
    """Structure and shape of a model: degree of the curve, time constants of the lags (s), search variables p of z."""

    degree: int
    T: tuple[float, ...]
    p: Array


class _Fitting:
    """Data set with its regressors and validation blocks, and methods that fit a model structure to it."""

    def __init__(self, data: Dataset, options: Options) -> None:
        # a polynomial of high degree is not valid outside the range of the rows to which it is fitted
        self.scaling, gain, offset = scaled_input(data.u[data.counted])
        self.data, self.x = data, gain * data.u[: data.train.stop] + offset
        self.all, self.kept, self.held = fitted_and_held(data, MOST_ROWS)
        self.variables = bouc_wen_variables(options["n_max"])
        self.lo, self.hi, self.scale = limits(self.variables)

    def columns(self, parts: Parts) -> Array:
        """Return the regressors of a structure: polynomials of x, lags of x, z, and lags of z."""
        z = operator(self.x, parts.p)[1]
        curve = legendre.legvander(np.clip(self.x, -1, 1), parts.degree)
        lags = [lag(self.data.h, T).run(v[:, None]) for v in (self.x, z) for T in parts.T]
        return np.column_stack([curve, *lags[: len(parts.T)], z, *lags[len(parts.T) :]])

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

        found = refined(Differences(misfit, self.scale, (self.lo, self.hi)), parts.p, evaluations, TOLERANCE)
        return replace(parts, p=found.p)

    def tried(self, parts: Parts) -> tuple[float, Parts]:
        """Fit a structure outside the validation blocks; return the RMS error on these blocks and the fit."""
        found = self.fit(parts, self.kept, EVALUATIONS[0])
        c = self.project(found, self.kept)[1]
        return rms(self.columns(found)[self.held] @ c - self.data.y[self.held]), found


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit the model of the module docstring; return graph, number of parameters, further results."""
    f = _Fitting(data, options)
    longest = max((data.train.stop - data.train.start) * data.h / 3, 10 * data.h)
    every = tuple(float(T) for T in np.geomspace(2 * data.h, longest, LAGS))
    T = every if options["rate"] == "yes" else ()
    starts = [np.array([np.log(z_max), share, n, 0.0]) for z_max, share, n in STARTS]
    # with a curve of too low degree, the search of z can end at a bound: it begins with a high degree
    first = int(options["degree"] or DEGREES[-2])
    best = min((f.tried(Parts(first, T, p)) for p in starts), key=lambda t: t[0])
    progress(0.4)
    if options["rate"] is None and _several_durations(data):  # with one duration, lags and loop cannot be separated
        more = min((f.tried(Parts(first, every, p)) for p in (best[1].p, starts[0])), key=lambda t: t[0])
        best = more if more[0] < BETTER * best[0] else best
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
    told = {"parts": _named(parts), "bounded": bounded(f.variables, parts.p)}
    return _graph(f, parts, c), len(c) + 4, told


def _several_durations(data: Dataset) -> bool:
    """Return whether the 90th percentile of the durations of half cycles is more than twice the 10th percentile.

    The speeds of the input are not a suitable test, because a decaying sine has many speeds but only one frequency.
    """
    lasting = np.diff(reversals(data.longest().u[data.longest().train]))
    long, short = np.percentile(lasting, [90, 10]) if len(lasting) else (1.0, 1.0)
    return bool(long > SPEEDS * short)


def _named(parts: Parts) -> str:
    words = [f"curve of degree {parts.degree}"] if parts.degree > 1 else []
    return ", ".join(["Bouc-Wen", *words, *([f"{len(parts.T)} lags"] if parts.T else [])])


def _graph(f: _Fitting, parts: Parts, c: Array) -> Graph:
    data, m, n = f.data, parts.degree + 1, len(parts.T)
    slope, r, weights, at_0 = dead_zones(c[:m])
    of_x, b, of_z = c[m : m + n], float(c[m + n]), c[m + n + 1 :]
    values = operator(f.x[:2], parts.p)[0]
    nodes = [
        f.scaling,
        Node("operator", "bouc_wen", {}, {**values, "alpha": 0.0, "k": 1.0}),
        Node("spring", "dead_zones", {"n": len(r)}, {"w0": slope, "r": r, "w": weights}),
    ]
    wires = [("input.y", "operator.u"), ("input.y", "spring.u"), ("spring.y", "readout.u[1]")]
    k, ends = [1.0, b], ["operator.z"]
    if n:
        lags: dict[str, Value] = {"T": np.array(parts.T), "start": "steady"}
        nodes += [Node("dashpot", "creep", {}, {"w": of_x, **lags}), Node("late", "creep", {}, {"w": of_z, **lags})]
        wires += [("input.y", "dashpot.u"), ("operator.z", "late.u")]
        k, ends = [*k, 1.0, 1.0], [*ends, "dashpot.y", "late.y"]
    wires += [(end, f"readout.u[{i}]") for i, end in enumerate(ends, 2)]
    nodes.append(Node("readout", "sum", {"n": len(k)}, {"k": k, "offset": at_0}))
    return device(data, nodes, wires)


KINDS = {"bouc_wen_parallel": Kind(TEXT, build, OPTIONS, CANDIDATES, Memory(1200.0))}
