"""Search of the coordinates from several starts: a short search from each, a full one from the best."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from hystfmu.base.arrays import Array
from hystfmu.identify.estimate.objective import Objective, OutOfTime

EVALUATIONS = (30, 200)  # limit on evaluations of residuals and Jacobian: per start, for the best start
TOLERANCES = (1e-8, 1e-13)  # relative change of the cost and of the coordinates that ends a search
ENOUGH = 1e-4  # misfit, relative to the size of the residuals, below which no other start is tried


@dataclass(frozen=True)
class Found:
    """Result of a search.

    Attributes
    ----------
    p : array, shape (n,)
        Coordinates.
    cost : float
        Half the sum of the squared residuals.
    whole : bool
        Whether the search converged, or ended at its time limit.
    """

    p: Array
    cost: float
    whole: bool = True

    @property
    def misfit(self) -> float:
        """RMS of the residuals, relative to their size."""
        return float(np.sqrt(2 * self.cost))


def refined(
    objective: Objective, p: Array, evaluations: int, tolerance: float = TOLERANCES[1], by_jacobian: bool = False
) -> Found:
    """Minimise the misfit from a point by trust-region steps.

    Parameters
    ----------
    objective : Objective
    p : array, shape (n,)
    evaluations : int
        Limit on evaluations of residuals and Jacobian.
    tolerance : float
        Relative change of cost and coordinates that ends the search.
    by_jacobian : bool
        Whether the columns of the Jacobian scale the steps, not the coordinates.
    """
    c = objective.coordinates
    if not len(p):
        return Found(p, float(np.sum(objective.residuals(p) ** 2)) / 2)
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
    objective: Objective,
    starts: Iterable[Array],
    evaluations: int,
    progress: Callable[[float], None] = lambda fraction: None,
    enough: float = ENOUGH,
) -> Found:
    """Search briefly from each start, and return the best; parameters as in `search`."""
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
    progress: Callable[[float], None] = lambda fraction: None,
    evaluations: tuple[int, int] = EVALUATIONS,
    enough: float = ENOUGH,
) -> Found:
    """Search briefly from each start, from the best to the end.

    Parameters
    ----------
    objective : Objective
    starts : sequence of array, shape (n,)
        Points to start from, the likeliest first.
    progress : function
        Called with the fraction done, 0..1.
    evaluations : (int, int)
        Limits on evaluations of residuals and Jacobian: per start, for the best start.
    enough : float
        Misfit, relative to the size of the residuals, below which no further start is tried.
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
