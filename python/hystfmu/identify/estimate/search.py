"""Search from several start points, and parameters that a record does not determine.

A short search begins at each start point, and a full search continues from the best result.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystfmu.base import Array, Progress, silent
from hystfmu.identify.estimate.objective import Objective, OutOfTime
from hystfmu.identify.solvers.trust_region import PART, Found, refined, spread

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
