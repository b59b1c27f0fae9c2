"""Standard errors of the free parameters, and the parameters that a record does not determine.

The Jacobian of the output by all free parameters, each column of length 1, is split by singular values. A direction
without effect means that the record determines only a combination of its parameters. Standard errors, as in
`hystfmu.identify.features.identifiable`, account for the correlation of the residuals.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.identify.estimate.objective import Objective
from hystfmu.identify.features.identifiable import correlation_time

NULL = 1e-5  # singular value, relative to the largest, of a direction without effect: above the error of differences
PART = 0.05  # of such a direction: from here on a parameter takes part in it
WIDE = 0.25  # standard error, relative to the room between the bounds, of a parameter that is as good as unknown


@dataclass(frozen=True)
class Determined:
    """Values and standard errors.

    Attributes
    ----------
    labels : tuple of str
        Elements of the free parameters.
    values, errors : array, shape (n,)
        Values; standard errors, infinite if the record does not determine the parameter, 0 at a bound.
    bound : array, shape (n,) of bool
        Whether a value is at a bound.
    condition : float
        Ratio of the largest to the smallest singular value of the scaled Jacobian, without parameters at a bound.
    together : tuple of tuple of str
        Parameters of which the record determines only a combination; a single one has no effect.
    """

    labels: tuple[str, ...]
    values: Array
    errors: Array
    bound: NDArray[np.bool_]
    condition: float
    together: tuple[tuple[str, ...], ...]

    @property
    def table(self) -> dict[str, dict[str, Any]]:
        """Entries of ``Model.fit["free"]``: value with ``standard_error``, or ``known`` = "at a bound" or "no"."""
        found: dict[str, dict[str, Any]] = {}
        for label, value, error, bound in zip(self.labels, self.values, self.errors, self.bound, strict=True):
            known = {"known": "at a bound"} if bound else {"known": "no"} if not np.isfinite(error) else {}
            found[label] = {"value": float(value), **(known or {"standard_error": float(error)})}
        return found

    @property
    def warnings(self) -> list[str]:
        """A line for each combination that the record does not determine."""
        found = []
        for names in self.together:
            if len(names) == 1:
                found.append(f"the record does not determine {names[0]}: hold it, or excite what it changes")
            else:
                listed = f"{', '.join(names[:-1])} and {names[-1]}"
                found.append(f"the record determines {listed} only together: hold one of them")
        return found


def determined(objective: Objective, p: Array) -> Determined:
    """Compute standard errors of all elements of parameters that depend on the coordinates or the weights.

    Parameters
    ----------
    objective : Objective
    p : array, shape (n,)
        Coordinates of the result.
    """
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
    length = np.linalg.norm(jacobian[:, free], axis=0)
    scaled = jacobian[:, free] / np.where(length > 0, length, 1.0)
    s, v = np.linalg.svd(scaled, full_matrices=False)[1:] if len(free) else (np.ones(1), np.zeros((1, 0)))
    null = s < NULL * s.max(initial=1e-300)
    variance = float(residuals @ residuals) / max(len(residuals) - len(free), 1) * correlation_time(residuals)
    inverse = v[~null].T / s[~null]
    length[length == 0] = np.inf
    spread = np.sqrt(variance) * inverse / length[:, None]
    errors: Array = np.linalg.norm(turn[:, free] @ spread, axis=1)
    moves = np.abs(turn) > 0
    of: list[tuple[str, ...]] = []
    for direction in v[null]:
        names = np.flatnonzero(moves[:, free[np.abs(direction) > PART]].any(axis=1))
        errors[names] = np.inf
        of.append(tuple(labels[k] for k in names))
    known = np.linalg.norm(spread, axis=1)
    for k, i in enumerate(free):
        if i < n and not null.any() and known[k] > WIDE * (c.hi[i] - c.lo[i]):
            names = np.flatnonzero(moves[:, i])
            errors[names] = np.inf
            of.append(tuple(labels[j] for j in names))
    bound = np.asarray(moves[:, held].any(axis=1) & ~moves[:, free].any(axis=1), dtype=bool)
    least = float(s.min(initial=1.0))
    return Determined(labels, values, errors, bound, float(s.max(initial=1.0)) / max(least, 1e-300), tuple(of))


def _labels(values: Mapping[str, Array]) -> list[str]:
    """Return names of elements: ``node.parameter``, or ``node.parameter[i]`` for an array."""
    return [name if len(v) == 1 else f"{name}[{k + 1}]" for name, v in values.items() for k in range(len(v))]
