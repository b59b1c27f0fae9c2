"""Recursive least squares in square-root form, sample by sample, with or without a dead zone.

Plain: P(k)^-1 = mu P(k-1)^-1 + h h'.  With R'R = P^-1, one orthogonal transformation of R and the new row h' gives the
next R; P itself, whose differences lose half the digits, is never formed.

With dead zone (IPMC paper, eqs. 13 to 19, corrected): eqs. 15 to 17 are a weighted update,
P(k)^-1 = mu (P(k-1)^-1 + c h h') with c = lambda / (mu Sigma), so the same transformation does, with row sqrt(c) h'.
Errata: sigma^2(k) = sigma^2(k-1) + (e^2(k) - sigma^2(k-1)) / k is a mean (printed: it grows without end);
lambda = beta (e^2(k) - r^2) / (h' P h r^2) takes the present error (printed: the variance, so lambda can be negative);
P stays as it is while lambda = 0 (printed: it grows as 1 / mu^k).  With beta = fraction * mu Sigma, the largest beta
allowed being mu Sigma, the weight is c = fraction (e^2 - r^2) / (h' P h r^2): Sigma cancels.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError

BLOCK = 4  # columns that LAPACK transforms at once; one new row gains nothing from more


class Recursive:
    """y = h' theta + e, theta updated by every sample.

    Parameters
    ----------
    n : int
        Number of parameters.
    eta : float
        P(0) = eta I; 1/eta is a ridge towards `theta`.
    mu : float
        Forgetting factor in (0, 1]; 1: all samples count alike, and theta is the least-squares solution of all of them
        with that ridge.
    dead_zone : float, optional
        r in the unit of y: an error of at most r changes nothing.  It must not be below the error that the best theta
        leaves, else the update chases noise and diverges.  Without it plain recursive least squares.
    fraction : float
        beta as a fraction of its bound mu Sigma, in (0, 1]; at 1 the error after the update is r^2 / e.
    theta : array, shape (n,), optional
        Where to start; default 0.

    Raises
    ------
    InputError
        A value out of range; from `update`, divergence.

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
                raise InputError(f"{name} must be {rule}; got {value}")
        start = np.zeros(n) if theta is None else np.asarray(theta, dtype=np.float64)
        if start.shape != (n,):
            raise InputError(f"theta must have shape ({n},); got {start.shape}")
        self.n, self.mu, self.dead_zone, self.fraction = n, mu, dead_zone, fraction
        self.samples, self.variance = 0, 0.0
        # [R z; 0 rho]: the triangle of the least-squares problem with its right-hand side as the last column
        self._triangle: Array = np.asfortranarray(np.eye(n + 1) / np.sqrt(eta))
        self._triangle[:n, n] = start / np.sqrt(eta)
        self._triangle[n, n] = 0.0

    @property
    def theta(self) -> Array:
        """The parameters (n,), from R theta = z."""
        return self._solve(self._triangle[: self.n, self.n], 0)

    def leverage(self, phi: Array) -> float:
        """h' P h = |R^-T h|^2 of a regressor h (n,)."""
        v = self._solve(phi, 1)
        return float(v @ v)

    def _solve(self, b: Array, transposed: int) -> Array:
        from scipy.linalg.lapack import dtrtrs  # several times as fast as solve_triangular for one small system

        return np.asarray(dtrtrs(self._triangle[: self.n, : self.n], b, trans=transposed)[0])

    def update(self, phi: Array, y: float) -> float:
        """Take one sample.

        Parameters
        ----------
        phi : array, shape (n,)
            Regressor h(k).
        y : float
            Measured output.

        Returns
        -------
        float
            The error e(k) = y - phi' theta(k-1) before the update.

        Raises
        ------
        InputError
            A value that is not finite, a regressor of another length, or divergence.
        """
        h = np.asarray(phi, dtype=np.float64)
        if h.shape != (self.n,):
            raise InputError(f"phi must have shape ({self.n},); got {h.shape}")
        if not (np.isfinite(h).all() and np.isfinite(y)):
            raise InputError(f"sample {self.samples}: phi and y must be finite")
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
        """R'R <- mu R'R + weight h h', or mu (R'R + weight h h') with a dead zone, by an orthogonal transformation."""
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
        return f"recursive least squares diverged at sample {self.samples}{reason}"


class PrintedRecursive:
    """The recursion with dead zone exactly as printed (IPMC paper, eqs. 13 to 19), for replicas: it fails.

    P itself is kept and grows as 1/mu^k while lambda = 0; sigma^2 = sum e^2(k)/k only grows, and lambda takes it
    instead of e^2, so lambda is negative as long as sigma^2 < r^2.

    Parameters
    ----------
    n : int
        Number of parameters.
    r : float
        Dead zone in the unit of y.
    eta : float
        P(0) = eta I.
    rho : float
        Convergence factor, constant in (0, 1), hence mu = 1 - rho.
    fraction : float
        beta as a fraction of its bound mu Sigma.  The paper gives neither rho, beta, eta nor Sigma(0); here
        Sigma(0) = r^2 and epsilon(k) = e(k).
    """

    def __init__(self, n: int, r: float, eta: float = 1e6, rho: float = 0.005, fraction: float = 1.0) -> None:
        self.r, self.rho, self.fraction = r, rho, fraction
        self.theta, self.P = np.zeros(n), eta * np.eye(n)
        self.samples, self.variance, self.Sigma = 0, 0.0, r * r

    def update(self, phi: Array, y: float) -> float:
        """Take one sample, the regressor phi (n,) and y; returns e(k)."""
        mu, r2 = 1 - self.rho, self.r**2
        e = float(y - phi @ self.theta)  # eq. 13
        self.samples += 1
        self.variance += e * e / self.samples
        self.Sigma += self.rho * (self.variance - self.Sigma)  # eq. 18
        Ph = self.P @ phi
        hPh = float(phi @ Ph)
        lam = 0.0 if abs(e) <= self.r else self.fraction * mu * self.Sigma * (self.variance - r2) / (hPh * r2)  # eq. 19
        K = lam * Ph / (lam * hPh + mu * self.Sigma)  # eqs. 15, 16
        self.theta = self.theta + K * e  # eq. 14
        self.P = (self.P - np.outer(K, Ph)) / mu  # eq. 17
        return e
