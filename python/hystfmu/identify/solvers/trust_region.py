"""Minimum of a sum of squares by trust-region steps, with finite differences and standard errors.

Let J be the Jacobian of the residuals. Let the residuals have the variance s^2 and the integrated correlation time T
(in rows). Then the covariance of the variables is about T s^2 (J' J)^-1 (Ljung, System Identification, 2nd ed. 1999,
eq. 9.10 to 9.14). T is near 1 for white noise. A model of the wrong class has slowly varying residuals, so its standard
errors are larger. To find parameters that the record does not determine, J is scaled to columns of norm 1, and its
singular values are computed. A direction with a singular value of almost 0 has no effect on the output. The record then
determines only a combination of the parameters in this direction.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from hystfmu.base import Array, Mask

MARGIN = 1e-10  # distance of a start point from its bounds, relative to their difference or to 1
TOLERANCE = 1e-13  # relative change of cost and coordinates that ends a search
NULL = 1e-5  # relative singular value of a direction without effect; it exceeds the error of finite differences
PART = 0.05  # a parameter belongs to such a direction if its absolute component is larger
DIFFERENCE = 1e-5  # finite difference, relative to the scale of a coordinate


@dataclass(frozen=True)
class Coordinates:
    """The coordinates (n,) of a search, with their bounds `lo` and `hi`.

    `scale` contains a step size for each coordinate, chosen so that all steps change the output by similar amounts. The
    function `values` returns the parameter values at a point (n,), by the names ``node.parameter``. It returns complete
    arrays, even if only some elements are free.
    """

    lo: Array
    hi: Array
    scale: Array
    values: Callable[[Array], Mapping[str, ArrayLike]]

    def inside(self, p: Array) -> Array:
        """Return the point p, moved inside its bounds."""
        room = MARGIN * np.minimum(np.maximum(self.hi - self.lo, 0.0), 1.0)
        return np.clip(p, self.lo + room, self.hi - room)

    def at_bounds(self, p: Array) -> Mask:
        """Return for each coordinate whether it is at a bound, shape (n,)."""
        room = 1e-6 * np.where(np.isfinite(self.hi - self.lo), self.hi - self.lo, 1.0)
        found: Mask = (p < self.lo + room) | (p > self.hi - room)
        return found

    def only(self, moved: Mask, p: Array) -> "Coordinates":
        """Return the coordinates selected by `moved` (n,); the other coordinates are fixed to their values in `p`."""

        def values(q: Array) -> Mapping[str, ArrayLike]:
            return self.values(self.joined(moved, p, q))

        return Coordinates(self.lo[moved], self.hi[moved], self.scale[moved], values)

    @staticmethod
    def joined(moved: Mask, p: Array, q: Array) -> Array:
        """Return the point `p` (n,) with the values `q` for the coordinates selected by `moved`."""
        whole = p.copy()
        whole[moved] = q
        return whole


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
    and an orthonormal basis (rows, m) of their columns. The derivatives are then those of Kaufman 1975.
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
        self._last: tuple[bytes | None, Array] = None, np.zeros(0)

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
    tolerance: float = TOLERANCE,
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


def standard_errors(residuals: Array, jacobian: Array, free: Mask) -> Array:
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
