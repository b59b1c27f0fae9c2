"""Auxiliary function f (eq. 3) and recursion (eqs. 13 to 19) of the IPMC paper, as printed and corrected.

As printed, f(k) = f(u_ex) + |u - u_ex| g(|u - u_ex|), where u_ex is the last extremum of the input. g(x) >= 0 is smooth
and monotone; the default is 1 - e^-x. With this formula, f increases whether the input increases or decreases.
Therefore it grows without bound and is not a function of the hysteresis state. The corrected formula is f(k) = f(u_ex)
+ (u - u_ex) g(|u - u_ex|), the Zhao-Tan operator. Models use the block `zhao_tan`, in which u_ex is the last extremum
that is not wiped out (dominant extremum). This module uses the last extremum, as in the text of the paper.
"""

from collections.abc import Callable

import numpy as np

from hystfmu.base import Array


def exponential(x: float) -> float:
    """Return 1 - e^-x."""
    return float(-np.expm1(-x))


def auxiliary(u: Array, corrected: bool = True, g: Callable[[float], float] = exponential) -> Array:
    """Return the auxiliary function f (n,) for an input u (n,). The first value of f is 0.

    Parameters
    ----------
    u : array, shape (n,)
        Scaled input. The scale has an effect, because g is nonlinear.
    corrected : bool
        True uses the corrected formula, with the sign of u - u_ex. False uses the printed formula.
    g : function
        Function that is smooth, monotone and not negative for arguments >= 0.
    """
    return from_last_extremum(u, lambda d: (d if corrected else abs(d)) * g(abs(d)))


def from_last_extremum(u: Array, branch: Callable[[float], float]) -> Array:
    """Return the operator (n,) f(k) = f(u_ex) + branch(u - u_ex) for an input u (n,), from 0 at the first row."""
    f = np.zeros(len(u))
    extreme, at_extreme, direction = float(u[0]), 0.0, 0.0
    for k in range(1, len(u)):
        s = float(np.sign(u[k] - u[k - 1]))
        if s * direction < 0:
            extreme, at_extreme = float(u[k - 1]), f[k - 1]
        direction = s or direction
        f[k] = at_extreme + branch(u[k] - extreme)
    return f


class PrintedRecursive:
    """Recursive least squares with dead zone exactly as printed (IPMC paper, eqs. 13 to 19), for the literal replica.

    This recursion fails for three reasons. P grows as 1/mu^k while lambda = 0. sigma^2 = sum e^2(k)/k can only grow.
    lambda contains sigma^2 instead of e^2, so that it is negative while sigma^2 < r^2. The paper does not state rho,
    beta, eta and Sigma(0). Here Sigma(0) = r^2 and epsilon(k) = e(k).

    Parameters
    ----------
    n : int
        Number of parameters.
    r : float
        Dead zone in the unit of measure of y.
    eta : float
        Initial covariance P(0) = eta I.
    rho : float
        Convergence factor, a constant in (0, 1). The forgetting factor is mu = 1 - rho.
    fraction : float
        Ratio of beta to its upper bound mu Sigma.
    """

    def __init__(self, n: int, r: float, eta: float = 1e6, rho: float = 0.005, fraction: float = 1.0) -> None:
        self.r, self.rho, self.fraction = r, rho, fraction
        self.theta, self.P = np.zeros(n), eta * np.eye(n)
        self.samples, self.variance, self.Sigma = 0, 0.0, r * r

    def update(self, phi: Array, y: float) -> float:
        """Update the parameters with one sample, and return the error e(k) before the update.

        phi is the regressor (n,), and y is the measured output.
        """
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
