"""Recursive least squares in square-root form, with or without a dead zone.

Without a dead zone, the update of the covariance P is P(k)^-1 = mu P(k-1)^-1 + h h', with the forgetting factor mu and
the regressor h. The triangular matrix R satisfies R'R = P^-1. One orthogonal transformation of R and the new row h'
computes the next R. P itself is never computed, because its update subtracts nearly equal numbers and loses half of the
digits.

The version with a dead zone r corrects eqs. 13 to 19 of the IPMC paper. Eqs. 15 to 17 are a weighted update P(k)^-1 =
mu (P(k-1)^-1 + c h h') with the weight c = lambda / (mu Sigma). The transformation is the same, with the row sqrt(c)
h'. Three printed equations are corrected:

- sigma^2(k) = sigma^2(k-1) + (e^2(k) - sigma^2(k-1)) / k is the mean of e^2. As printed, it grows without bound.
- lambda = beta (e^2(k) - r^2) / (h' P h r^2) contains the present error e(k). In the paper, it contains the variance
  sigma^2 instead, so that lambda can be negative.
- P does not change while lambda = 0. As printed, P grows as 1 / mu^k.

The largest allowed beta is mu Sigma. With beta = fraction * mu Sigma, the weight is c = fraction (e^2 - r^2) / (h' P h
r^2). This weight does not contain Sigma.
"""

import numpy as np

from hystfmu.base import Array, InputError

BLOCK = 4  # block size of the update in LAPACK; a larger one is not faster for one new row


class Recursive:
    """Recursive estimator of the parameters theta in y = h' theta + e.

    Parameters
    ----------
    n : int
        Number of parameters.
    eta : float
        Initial covariance P(0) = eta I. 1/eta is a ridge penalty on the distance from the initial parameters.
    mu : float
        Forgetting factor in (0, 1]. With mu = 1 and without a dead zone, all samples have the same weight, and theta is
        the least-squares solution with this ridge penalty.
    dead_zone : float, optional
        Largest error that changes no parameter, in the unit of measure of y. If it is smaller than the largest error
        with the best theta, the parameters follow the noise and diverge. By default, there is no dead zone.
    fraction : float
        Ratio of beta to its upper bound mu Sigma, in (0, 1]. With 1, the error after the update is r^2 / e.
    theta : array, shape (n,), optional
        Initial parameters, 0 by default.

    Raises
    ------
    InputError
        A value is out of range, or the recursion diverges.

    References
    ----------
    IPMC paper, section 5; Golub & Van Loan, Matrix Computations, 6.5 (updating QR factorisations).
    """

    def __init__(
        self,
        n: int,
        eta: float = 1e6,
        mu: float = 1.0,
        dead_zone: float | None = None,
        fraction: float = 1.0,
        theta: Array | None = None,
    ) -> None:
        for name, value, legal, rule in (
            ("n", n, n >= 1, "at least 1"),
            ("eta", eta, 0 < eta < np.inf, "in (0, inf)"),
            ("mu", mu, 0 < mu <= 1, "in (0, 1]"),
            ("dead_zone", dead_zone, dead_zone is None or 0 < dead_zone < np.inf, "in (0, inf)"),
            ("fraction", fraction, 0 < fraction <= 1, "in (0, 1]"),
        ):
            if not legal:
                raise InputError(
                    f"The {name!r} parameter of recursive least squares must be {rule}. Got {value} instead."
                )
        start = np.zeros(n) if theta is None else np.asarray(theta, dtype=np.float64)
        if start.shape != (n,):
            raise InputError(f"The 'theta' array must have shape ({n},). Got {start.shape} instead.")
        self.n, self.mu, self.dead_zone, self.fraction = n, mu, dead_zone, fraction
        self.samples, self.variance = 0, 0.0
        # triangular matrix [R z; 0 rho] of the least-squares problem; the right-hand side is the last column
        self._triangle: Array = np.asfortranarray(np.eye(n + 1) / np.sqrt(eta))
        self._triangle[:n, n] = start / np.sqrt(eta)
        self._triangle[n, n] = 0.0

    @property
    def theta(self) -> Array:
        """Present parameters (n,). They are the solution of R theta = z, where z is the transformed right-hand side."""
        return self._solve(self._triangle[: self.n, self.n], 0)

    def leverage(self, phi: Array) -> float:
        """Return h' P h for the regressor h = `phi` (n,), computed as |R^-T h|^2."""
        v = self._solve(phi, 1)
        return float(v @ v)

    def _solve(self, b: Array, transposed: int) -> Array:
        from scipy.linalg.lapack import dtrtrs  # several times faster than solve_triangular for one small system

        return np.asarray(dtrtrs(self._triangle[: self.n, : self.n], b, trans=transposed)[0])

    def update(self, phi: Array, y: float) -> float:
        """Update the parameters with one sample, and return the error before the update.

        `phi` is the regressor h(k), shape (n,), and `y` is the measured output. The error is e(k) = y - phi'
        theta(k-1). An InputError is raised if a value is not finite, if phi has another length, or if the recursion
        diverges.
        """
        h = np.asarray(phi, dtype=np.float64)
        if h.shape != (self.n,):
            raise InputError(f"The 'phi' array must have shape ({self.n},). Got {h.shape} instead.")
        if not (np.isfinite(h).all() and np.isfinite(y)):
            bad = next(float(v) for v in [*h, y] if not np.isfinite(v))
            raise InputError(f"sample {self.samples}: The values of phi and y must be finite. Got {bad} instead.")
        e = float(y - h @ self.theta)
        self.samples += 1
        self.variance += (e * e - self.variance) / self.samples
        weight = 1.0
        if self.dead_zone is not None:
            if abs(e) <= self.dead_zone:
                return e
            r2 = self.dead_zone**2
            with np.errstate(all="ignore"):
                weight = float(np.divide(self.fraction * (e * e - r2), self.leverage(h) * r2))
            if not np.isfinite(weight):
                raise InputError(self._diverged())
        self._append(h, y, weight)
        return e

    def _append(self, h: Array, y: float, weight: float) -> None:
        """Update R for one sample with regressor h, output y and a weight.

        R'R becomes mu R'R + weight h h' without a dead zone, and mu (R'R + weight h h') with a dead zone.
        """
        from scipy.linalg.lapack import dtpqrt

        root = np.sqrt(self.mu)
        row = np.sqrt(weight) * np.append(h, y)
        if self.dead_zone is None:
            self._triangle *= root
        self._triangle = dtpqrt(0, min(BLOCK, self.n + 1), self._triangle, np.asfortranarray(row[None]), overwrite_a=1)[
            0
        ]
        if self.dead_zone is not None:
            self._triangle *= root
        if not np.isfinite(self._triangle).all():
            raise InputError(self._diverged())

    def _diverged(self) -> str:
        reason = "" if self.dead_zone is None else f": the dead zone {self.dead_zone:g} is below the achievable error"
        return f"Recursive least squares must converge. It diverged at sample {self.samples}{reason}."
