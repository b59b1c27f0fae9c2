"""Search of the coordinates from several starts: each briefly, the best to the end."""

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
    """What a search found.

    Attributes
    ----------
    p : array, shape (n,)
        Coordinates.
    cost : float
        Half the sum of the squared residuals.
    whole : bool
        Whether the search came to its end, or ended at its limit of time.
    """

    p: Array
    cost: float
    whole: bool = True

    @property
    def misfit(self) -> float:
        """RMS of the residuals, relative to their size."""
        return float(np.sqrt(2 * self.cost))


def search(
    objective: Objective,
    starts: Sequence[Array] | Iterable[Array],
    progress: Callable[[float], None] = lambda fraction: None,
    evaluations: tuple[int, int] = EVALUATIONS,
    tolerances: tuple[float, float] = TOLERANCES,
    enough: float = ENOUGH,
) -> Found:
    """Minimise the misfit by trust-region steps.

    Parameters
    ----------
    objective : Objective
    starts : sequence of array, shape (n,)
        Points to start from, the likeliest first.
    progress : function
        Called with the fraction done, 0..1.
    evaluations : (int, int)
        Limits on evaluations of residuals and Jacobian: per start, for the best start.
    tolerances : (float, float)
        Relative change of cost and coordinates that ends a search: of a start, of the best start.
    enough : float
        Misfit, relative to the size of the residuals, below which no other start is tried.
    """
    c, points = objective.coordinates, list(starts)

    def refined(p: Array, most: int, tolerance: float) -> Found:
        if not len(p):
            return Found(p, float(np.sum(objective.residuals(p) ** 2)) / 2)
        r = least_squares(
            objective.residuals,
            c.inside(p),
            objective.jacobian,
            (c.lo, c.hi),
            x_scale=c.scale,
            ftol=tolerance,
            xtol=tolerance,
            gtol=tolerance,
            max_nfev=most,
        )
        return Found(np.asarray(r.x), float(r.cost))

    best = None
    try:
        for i, point in enumerate(points):
            progress(i / (len(points) + 1))
            if len(points) > 1:
                found = refined(point, evaluations[0], tolerances[0])
                if best is None or found.cost < best.cost:
                    best = found
                if best.misfit < enough:
                    break
        progress(len(points) / (len(points) + 1))
        return refined(points[0] if best is None else best.p, evaluations[1], tolerances[1])
    except OutOfTime:
        cost, p = objective.best
        if not len(p) and len(c.lo):
            p = c.inside(points[0])
        return Found(p, cost, whole=False)
