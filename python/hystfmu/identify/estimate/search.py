"""Search from several start points, standard errors, and parameters that a record does not determine.

A short search begins at each start point, and a full search continues from the best result. Let J be the Jacobian of
the residuals with respect to all free parameters. Let the residuals have the variance s^2 and the integrated
correlation time T (in rows). Then the covariance of the parameters is about T s^2 (J' J)^-1 (Ljung, System
Identification, 2nd ed. 1999, eq. 9.10 to 9.14). T is near 1 for white noise. A model of the wrong class has slowly
varying residuals, so its standard errors are larger. To find parameters that the record does not determine, J is scaled
to columns of norm 1, and its singular values are computed. A direction with a singular value of almost 0 has no effect
on the output. The record then determines only a combination of the parameters in this direction.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from hystfmu.base.arrays import Array, Progress, silent
from hystfmu.identify.estimate.coordinates import Coordinates
from hystfmu.identify.estimate.objective import Objective, OutOfTime

EVALUATIONS = (30, 200)  # maximum number of evaluations of residuals and Jacobian: per start point, for the best one
TOLERANCES = (1e-8, 1e-13)  # relative change of cost and coordinates that ends a short search, and a full search
ENOUGH = 1e-4  # RMS of the scaled residuals below which no further start point is tried
NULL = 1e-5  # relative singular value of a direction without effect; it exceeds the error of finite differences
PART = 0.05  # a parameter belongs to such a direction if its absolute component is larger
DIFFERENCE = 1e-5  # finite difference, relative to the scale of a coordinate
WIDE = 0.25  # standard error, relative to the distance of the bounds, above which a parameter counts as not determined


@dataclass(frozen=True)
class Found:
    """Result of a search: coordinates p (n,), and half the sum of squared residuals.

    `whole` is False if the time limit ended the search.
    """

    p: Array
    cost: float
    whole: bool = True

    @property
    def misfit(self) -> float:
        """RMS error, relative to `size` of the `Objective`."""
        return float(np.sqrt(2 * self.cost))


class Residuals(Protocol):
    """Objective of a search."""

    coordinates: Coordinates

    def residuals(self, p: Array) -> Array:
        """Return the residuals (rows,) at a point p (n,)."""

    def jacobian(self, p: Array) -> Array:
        """Return the derivatives (rows, n) of the residuals at a point p."""


class Differences:
    """Objective whose residuals are any function of the coordinates p (n,), with a Jacobian by finite differences.

    A finite difference has the size `step` times the scale of the coordinate, and stays inside the bounds. The last
    residuals are stored, because a search computes the derivatives at the same point. If the function fits linear
    parameters at each point, `held` gives a function of the coordinates that keeps the linear parameters of a point,
    and an orthonormal basis (rows, m) of their columns. The derivatives are then those of Kaufman (see `objective`).
    """

    def __init__(
        self,
        residuals: Callable[[Array], Array],
        scale: Array,
        bounds: tuple[Array | float, Array | float] = (-np.inf, np.inf),
        step: float = DIFFERENCE,
        held: Callable[[Array], tuple[Callable[[Array], Array], Array]] | None = None,
    ) -> None:
        lo, hi = (np.broadcast_to(bound, scale.shape) for bound in bounds)
        self.coordinates, self._of, self._step = Coordinates(lo, hi, scale, lambda p: {}), residuals, step
        self._held = held
        self._last: tuple[bytes, Array] = b"", np.zeros(0)

    def residuals(self, p: Array) -> Array:
        """Return the residuals (rows,) at a point p."""
        if self._last[0] != (key := p.tobytes()):
            self._last = key, self._of(p)
        return self._last[1]

    def slopes(self, p: Array) -> tuple[Array, Array | None]:
        """Return the derivatives (rows, n) for the linear parameters of a point p, and the basis of their columns."""
        of, basis = self._held(p) if self._held else (self._of, None)
        here, c = of(p) if self._held else self.residuals(p), self.coordinates
        steps = self._step * c.scale
        steps = np.where(p + steps > c.hi, -steps, steps)
        return np.column_stack([(of(p + d) - here) / d[k] for k, d in enumerate(np.diag(steps))]), basis

    def jacobian(self, p: Array) -> Array:
        """Return the derivatives (rows, n) of the residuals at a point p."""
        found, basis = self.slopes(p)
        return found if basis is None else found - basis @ (basis.T @ found)


def refined(
    objective: Residuals,
    p: Array,
    evaluations: int,
    tolerance: float = TOLERANCES[1],
    by_jacobian: bool = False,
) -> Found:
    """Minimise the sum of squared residuals from a point p (n,) by trust-region steps.

    The search ends when the relative change of cost and coordinates is at most `tolerance`, or after `evaluations`
    evaluations of residuals and Jacobian. With `by_jacobian`, the steps are scaled by the columns of the Jacobian,
    otherwise by the scales of the coordinates.
    """
    c = objective.coordinates
    if not len(p):
        return Found(p, float(np.sum(objective.residuals(p) ** 2)) / 2)
    with np.errstate(over="ignore", invalid="ignore"):  # far from the optimum the slopes of a model may overflow
        r = least_squares(
            objective.residuals,
            c.inside(p),
            objective.jacobian,
            (c.lo, c.hi),
            x_scale="jac" if by_jacobian else c.scale,
            ftol=tolerance,
            xtol=tolerance,
            gtol=tolerance,
            max_nfev=evaluations,
        )
    return Found(np.asarray(r.x), float(r.cost))


def best_of(
    objective: Objective, starts: Iterable[Array], evaluations: int, progress: Progress = silent, enough: float = ENOUGH
) -> Found:
    """Return the best result of short searches from all start points; `search` explains the arguments."""
    points, best = list(starts), None
    for i, point in enumerate(points):
        progress(i / len(points))
        found = refined(objective, point, evaluations, TOLERANCES[0])
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


def spread(residuals: Array, jacobian: Array) -> tuple[Array, Array, float]:
    """Return the accuracy of n variables from the residuals (m,) and their Jacobian (m, n).

    The result is a root S (n, k) of the covariance S S' of the variables, the directions (l, n) without effect on the
    residuals, and the ratio of the largest to the smallest singular value of the scaled Jacobian.
    """
    length = np.linalg.norm(jacobian, axis=0)
    s, v = np.linalg.svd(jacobian / np.where(length > 0, length, 1.0), full_matrices=False)[1:]
    null = s < NULL * s.max(initial=1e-300)
    variance = float(residuals @ residuals) / max(len(residuals) - len(length), 1) * correlation_time(residuals)
    length[length == 0] = np.inf
    condition = float(s.max(initial=1.0)) / max(float(s.min(initial=1.0)), 1e-300)
    return np.sqrt(variance) * (v[~null].T / s[~null]) / length[:, None], v[null], condition


def standard_errors(residuals: Array, jacobian: Array, free: NDArray[np.bool_]) -> Array:
    """Return the standard errors (n,) of parameters from the residuals (m,) and their Jacobian (m, n).

    The error of a parameter that is not `free` (n,) is 0. The error of a parameter without effect is infinite.
    """
    root, null, _ = spread(residuals, jacobian[:, free])
    found = np.zeros(jacobian.shape[1])
    found[free] = np.where((np.abs(null) > PART).any(axis=0), np.inf, np.linalg.norm(root, axis=1))
    return found


def correlation_time(residuals: Array) -> float:
    """Return the correlation time (rows): 1 + 2 times the sum of the autocorrelation up to its first zero."""
    e = residuals - residuals.mean()
    power = float(e @ e)
    if power == 0:
        return 1.0
    n = 1 << (2 * len(e) - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(e, n)) ** 2
    correlation = np.fft.irfft(spectrum, n)[: len(e)] / power
    end = int(np.argmax(correlation <= 0)) or len(correlation)
    return float(1 + 2 * correlation[1:end].sum())


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
    bound: NDArray[np.bool_]
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
                found.append(f"the record does not determine {names[0]}: hold it, or excite what it changes")
            else:
                listed = f"{', '.join(names[:-1])} and {names[-1]}"
                found.append(f"the record determines {listed} only together: hold one of them")
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
