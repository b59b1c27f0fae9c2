"""Residuals of the simulation of a graph as a function of the coordinates of a search, and this search.

At each point of the search, linear least squares gives the linear parameters; parameters that must not be negative are
constrained (variable projection, Golub & Pereyra 1973). The column of a linear parameter is the change of the output if
the parameter changes by 1. The Jacobian is computed with fixed linear parameters, and is then projected on the
orthogonal complement of these columns (Kaufman 1975). This Jacobian neglects only a term of second order in the
residuals.

A short search begins at each start point, and a full search continues from the best result.
"""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hystfmu.base import Array, Indices, InputError, Mask, Progress, silent
from hystfmu.data import Dataset
from hystfmu.graph import Graph
from hystfmu.identify.estimate.runs import DIFFERENCE, Runs
from hystfmu.identify.solvers.nonnegative import nonnegative
from hystfmu.identify.solvers.trust_region import PART, Coordinates, Found, refined, spread
from hystfmu.model import rows_of

TURN = 1e-5  # finite difference of a coordinate, relative to its scale
FARTHEST = 1e3  # norm of the residuals that is assumed if a trial diverges or the core refuses its values
DEPENDENT = 1e-10  # relative singular value of normalised columns below which a combination counts as dependent
MOST = 1e100  # largest permitted output, because squares of larger values can overflow


@dataclass(frozen=True)
class Linear:
    """A parameter ``node.parameter`` on which the output depends linearly, and the indices of its linear elements.

    If `positive` is True, the elements must not be negative.
    """

    name: str
    elements: tuple[int, ...] = (0,)
    positive: bool = False


class OutOfTime(Exception):
    """The time limit of a search is reached."""


class Objective:
    """Residuals of the simulation of a graph on selected rows.

    The graph has one output, and its inputs are u and the covariates of the data. If the structure of the graph depends
    on the point, `graph` is a function that returns the graph at a point. It must return the same object for the same
    structure. For example, a delay with another number of samples is another structure. The residuals are divided by
    `size`, by default the span of y times the square root of the number of rows. `rows` contains the selected rows, by
    default the training rows without held-out rows. At the time `until` (`time.monotonic`), a search ends with the best
    point so far.
    """

    def __init__(
        self,
        data: Dataset,
        graph: Graph | Callable[[Array], Graph],
        coordinates: Coordinates,
        linear: Sequence[Linear] = (),
        size: float | None = None,
        rows: Indices | None = None,
        until: float = np.inf,
    ) -> None:
        self.structure = (lambda p: graph) if isinstance(graph, Graph) else graph
        self.coordinates, self.linear, self.until = coordinates, tuple(linear), until
        self.h = data.h
        self.rows = np.arange(len(data.u))[data.counted] if rows is None else rows
        self.y = data.y[self.rows]
        self.size = data.span * np.sqrt(len(self.y)) if size is None else size
        inputs = rows_of(self.structure(coordinates.inside(np.zeros(len(coordinates.lo)))), data)
        inputs = inputs.reshape(len(data.u), -1)
        cuts = [(r.start, self.rows[(r.start <= self.rows) & (self.rows < r.stop)]) for r in data.records]
        self._parts = [(inputs[first : rows[-1] + 1], rows - first) for first, rows in cuts if len(rows)]
        self.positive = np.array([part.positive for part in linear for _ in part.elements], dtype=bool)
        self._runs: dict[Graph, Runs] = {}
        self._point: tuple[bytes | None, Array, Array, Array] = None, np.zeros(0), np.zeros(0), np.zeros(0)
        self._slopes: tuple[bytes | None, Array] = None, np.zeros(0)
        self.best: tuple[float, Array] = np.inf, np.zeros(0)

    # ---- values -----------------------------------------------------------------------------------------------------
    def values(self, p: Array, weights: Array) -> dict[str, Array]:
        """Return the values of all free parameters at a point p, for given values `weights` of linear parameters."""
        found = {k: np.array(v, dtype=np.float64).reshape(-1) for k, v in self.coordinates.values(p).items()}
        at = 0
        for part in self.linear:
            n = len(part.elements)
            if part.name not in found:
                node, _, parameter = part.name.partition(".")
                found[part.name] = self.structure(p).node(node).value(parameter)
            found[part.name][list(part.elements)] = weights[at : at + n]
            at += n
        return found

    def graph(self, p: Array) -> Graph:
        """Return the graph with the parameter values at a point p."""
        graph, values = self.structure(p), self.values(p, self.project(p)[1])
        for node in graph.nodes:
            own = {k.partition(".")[2]: v for k, v in values.items() if k.partition(".")[0] == node.name}
            plain = {k: v if node.sizes[k] != 1 else float(v[0]) for k, v in own.items()}
            graph = graph.replace(node.with_values(**plain)) if own else graph
        return graph

    # ---- runs -------------------------------------------------------------------------------------------------------
    def _run(
        self,
        graph: Graph,
        values: Mapping[str, Array],
        changes: Sequence[Mapping[str, Array]],
        step: float = DIFFERENCE,
    ) -> tuple[Array, Array]:
        """Simulate all records; return the output (rows,) and its derivatives (rows, changes) on the selected rows."""
        if self.best[0] < np.inf and time.monotonic() > self.until:
            raise OutOfTime
        if graph not in self._runs:
            self._runs[graph] = Runs(graph)
        runs = self._runs[graph]
        runs.put(values)
        parts = [runs.sensitivities(u, self.h, changes, rows, step) for u, rows in self._parts]
        y, dy = parts[0] if len(parts) == 1 else map(np.concatenate, zip(*parts, strict=True))
        if not np.abs(y).max() < MOST:
            raise InputError(f"The output must be below {MOST:g}. Got one that grows.")
        return y, dy

    def columns(self, p: Array) -> tuple[Array, Array]:
        """Return the output (rows,) for linear parameters of 0, and its change (rows, weights) if one of them is 1.

        Values that the core refuses, or an output that is not finite, raise an InputError.
        """
        values = self.values(p, np.zeros(len(self.positive)))
        base, found = self._run(self.structure(p), values, self.weighed(values), 1.0)
        if not np.abs(found).max(initial=0.0) < MOST:
            raise InputError(f"The output must be below {MOST:g}. Got one that grows.")
        return base, found

    def project(self, p: Array) -> tuple[Array, Array, Array]:
        """Fit the linear parameters at a point p; return residuals (rows,), parameters, and a basis of their columns.

        The basis is orthonormal. It does not include columns of constrained parameters with the value 0.
        """
        key = p.tobytes()
        if key != self._point[0]:
            try:
                base, columns = self.columns(p)
            except InputError:
                n = len(self.y)
                self._point = key, np.full(n, FARTHEST / np.sqrt(n)), np.zeros(len(self.positive)), np.zeros((n, 0))
            else:
                self._point = key, *self._solved(base, columns)
            cost = float(self._point[1] @ self._point[1]) / 2
            if cost < self.best[0]:
                self.best = cost, p.copy()
        return self._point[1:]

    def _solved(self, base: Array, columns: Array) -> tuple[Array, Array, Array]:
        length = np.linalg.norm(columns, axis=0)
        length[length == 0] = 1.0
        columns, left, x = columns / length, self.y - base, np.zeros(len(length))
        moves = np.ones(len(length), dtype=bool)
        if self.positive.any():
            x[self.positive], _ = nonnegative(columns[:, self.positive], left, columns[:, ~self.positive])
            moves = ~self.positive | (x > 0)
        U, s, Vt = np.linalg.svd(columns[:, moves], full_matrices=False)
        kept = s > DEPENDENT * s.max(initial=0.0)
        U, s, Vt = U[:, kept], s[kept], Vt[kept]
        held = np.maximum(Vt.T @ ((U.T @ left) / s), np.where(self.positive[moves], 0.0, -np.inf))
        x[moves] = held
        return (columns @ x - left) / self.size, x / length, U

    def residuals(self, p: Array) -> Array:
        """Return the residuals at a point p, divided by `size`, shape (rows,)."""
        return self.project(p)[0]

    def sensitivities(self, p: Array) -> Array:
        """Return the derivatives (rows, n) of the output with respect to the coordinates, for fixed linear parameters.

        If a coordinate cannot be changed in any direction, its derivative is 0.
        """
        if self._slopes[0] != (key := p.tobytes()):
            weights, scale = self.project(p)[1], self.coordinates.scale
            changes = [{k: x * scale[i] for k, x in change.items()} for i, change in enumerate(self.turns(p, weights))]
            try:
                found = self._run(self.structure(p), self.values(p, weights), changes)[1] / scale
            except InputError:
                found = np.zeros((len(self.y), len(p)))
            self._slopes = key, np.where(np.isfinite(found), found, 0.0)
        return self._slopes[1]

    def weighed(self, values: Mapping[str, Array]) -> list[dict[str, Array]]:
        """Return the derivatives of the parameter values with respect to each linear parameter."""
        return [
            {part.name: np.eye(len(values[part.name]))[element]} for part in self.linear for element in part.elements
        ]

    def turns(self, p: Array, weights: Array) -> list[dict[str, Array]]:
        """Return the derivatives of the parameter values with respect to each coordinate, by finite differences.

        A step must stay inside the bounds and must not change the structure of the graph.
        """
        c, graph, here = self.coordinates, self.structure(p), self.values(p, weights)
        found: list[dict[str, Array]] = []
        for k, unit in enumerate(np.eye(len(p))):
            ends = []
            for step in (TURN * c.scale[k], -TURN * c.scale[k]):
                inside = c.lo[k] <= p[k] + step <= c.hi[k] and self.structure(p + step * unit) is graph
                ends.append((step, self.values(p + step * unit, weights)) if inside else (0.0, here))
            (up, above), (down, below) = ends
            apart = (up - down) or 1.0
            found.append({name: (above[name] - below[name]) / apart for name in here})
        return found

    def jacobian(self, p: Array) -> Array:
        """Return the derivatives (rows, n) of the residuals, with the linear parameters optimised at each point."""
        residuals, _, basis = self.project(p)
        if residuals @ residuals >= FARTHEST**2 / 2:
            return np.zeros((len(self.y), len(p)))
        found = self.sensitivities(p) / self.size
        return found - basis @ (basis.T @ found)


EVALUATIONS = (30, 200)  # maximum number of evaluations of residuals and Jacobian: per start point, for the best one
SHORT = 1e-8  # relative change of cost and coordinates that ends a short search
ENOUGH = 1e-4  # RMS of the scaled residuals below which no further start point is tried
WIDE = 0.25  # standard error, relative to the distance of the bounds, above which a parameter counts as not determined


def best_of(
    objective: Objective, starts: Iterable[Array], evaluations: int, progress: Progress = silent, enough: float = ENOUGH
) -> Found:
    """Return the best result of short searches from all start points; `search` explains the arguments."""
    points, best = list(starts), None
    for i, point in enumerate(points):
        progress(i / len(points))
        found = refined(objective, point, evaluations, SHORT)
        if best is None or found.cost < best.cost:
            best = found
        if best.misfit < enough:
            break
    assert best is not None
    return best


def search(
    objective: Objective,
    starts: Sequence[Array],
    progress: Progress = silent,
    evaluations: tuple[int, int] = EVALUATIONS,
    enough: float = ENOUGH,
) -> Found:
    """Run a short search from each start point (n,), then a full search from the best result.

    `evaluations` contains the maximum numbers of evaluations of residuals and Jacobian, for each short search and for
    the full search. If a short search reaches an RMS error below `enough`, no further start point is tried. Therefore
    the likeliest start point should be the first.
    """
    share = len(starts) / (len(starts) + 1)
    try:
        first = starts[0]
        if len(starts) > 1:
            first = best_of(objective, starts, evaluations[0], lambda f: progress(share * f), enough).p
        progress(share)
        return refined(objective, first, evaluations[1])
    except OutOfTime:
        cost, p = objective.best
        return Found(p, cost, whole=False)


@dataclass(frozen=True)
class Determined:
    """Values and standard errors of the elements of free parameters, in the order of their names `labels`.

    A standard error is infinite if the record does not determine the element, and 0 if the element is at a bound.
    `condition` is the ratio of the largest to the smallest singular value of the scaled Jacobian, without elements at a
    bound. Each group in `together` contains elements of which the record determines only a combination. If a group has
    one element, the record does not determine this element.
    """

    labels: tuple[str, ...]
    values: Array
    errors: Array
    bound: Mask
    condition: float
    together: tuple[tuple[str, ...], ...]

    @property
    def table(self) -> dict[str, dict[str, Any]]:
        """Entries of ``Model.fit["free"]``: the value, and ``standard_error`` or ``known`` ("at a bound" or "no")."""
        found: dict[str, dict[str, Any]] = {}
        for label, value, error, bound in zip(self.labels, self.values, self.errors, self.bound, strict=True):
            known = {"known": "at a bound"} if bound else {"known": "no"} if not np.isfinite(error) else {}
            found[label] = {"value": float(value), **(known or {"standard_error": float(error)})}
        return found

    @property
    def warnings(self) -> list[str]:
        """Warnings, one for each group in `together`."""
        found = []
        for names in self.together:
            if len(names) == 1:
                found.append(
                    f"the record does not determine {names[0]}: fix it, or use an input for which it changes the output"
                )
            else:
                listed = f"{', '.join(names[:-1])} and {names[-1]}"
                found.append(f"the record determines {listed} only together: fix one of them")
        return found


def determined(objective: Objective, p: Array) -> Determined:
    """Return the values and standard errors of all elements of the free parameters at the point p (n,) of a search."""
    residuals, weights, _ = objective.project(p)
    n, c = len(p), objective.coordinates
    _, columns = objective.columns(p)
    jacobian = np.column_stack([objective.sensitivities(p), columns]) / objective.size
    held = np.concatenate([c.at_bounds(p), objective.positive & (weights <= 0)])

    found = objective.values(p, weights)
    none = {name: np.zeros(len(v)) for name, v in found.items()}

    def read(values: Mapping[str, Array]) -> Array:
        return np.concatenate([np.zeros(0), *{**none, **values}.values()])

    values = read(found)
    turn: Array = np.column_stack(
        [read(change) for change in [*objective.turns(p, weights), *objective.weighed(found)]]
    )
    some = np.flatnonzero(turn.any(axis=1))
    turn, values = turn[some], values[some]
    labels = tuple(np.array(_labels(found))[some].tolist())

    free = np.flatnonzero(~held)
    root, null, condition = spread(residuals, jacobian[:, free])
    errors: Array = np.linalg.norm(turn[:, free] @ root, axis=1)
    moves = np.abs(turn) > 0
    of: list[tuple[str, ...]] = []
    for direction in null:
        names = np.flatnonzero(moves[:, free[np.abs(direction) > PART]].any(axis=1))
        errors[names] = np.inf
        of.append(tuple(labels[k] for k in names))
    known = np.linalg.norm(root, axis=1)
    for k, i in enumerate(free):
        if i < n and not len(null) and known[k] > WIDE * (c.hi[i] - c.lo[i]):
            names = np.flatnonzero(moves[:, i])
            errors[names] = np.inf
            of.append(tuple(labels[j] for j in names))
    bound = np.asarray(moves[:, held].any(axis=1) & ~moves[:, free].any(axis=1), dtype=bool)
    return Determined(labels, values, errors, bound, condition, tuple(of))


def _labels(values: Mapping[str, Array]) -> list[str]:
    """Return the names of all elements: ``node.parameter``, or ``node.parameter[i]`` for an array."""
    return [name if len(v) == 1 else f"{name}[{k + 1}]" for name, v in values.items() for k in range(len(v))]
