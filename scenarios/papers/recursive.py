"""Recursive least squares, sample by sample, with or without a dead zone, by the block ``recursive_least_squares``.

Without dead zone: P(k)^-1 = mu P(k-1)^-1 + h h'.

With dead zone (IPMC paper, eqs. 13 to 19, corrected): eqs. 15 to 17 are a weighted update,
P(k)^-1 = mu (P(k-1)^-1 + c h h') with c = lambda / (mu Sigma). Errata: sigma^2(k) = sigma^2(k-1) + (e^2(k) -
sigma^2(k-1)) / k is a mean (as printed it grows without bound); lambda = beta (e^2(k) - r^2) / (h' P h r^2) uses the
present error (printed: the variance, so lambda can be negative); P does not change while lambda = 0 (printed: it grows
as 1 / mu^k).  With beta = fraction * mu Sigma, where mu Sigma is the largest beta allowed, the weight is
c = fraction (e^2 - r^2) / (h' P h r^2): Sigma cancels.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Node, Value

MOST = float(np.finfo(float).max)


class Recursive:
    """Recursive estimator of theta in y = h' theta + e.

    The initial covariance is P(0) = eta I; 1/eta is a ridge towards the initial parameters, which are 0 by default. mu
    in (0, 1] is the forgetting factor. With mu = 1 all samples have the same weight, and theta is their least-squares
    solution with this ridge. An error of at most the dead zone, in the unit of measure of y, changes no parameter.
    Trap: if the dead zone is smaller than the error of the best theta, the update follows noise and diverges. Without a
    dead zone the update is plain recursive least squares. `fraction` in (0, 1] is beta as a fraction of its bound mu
    Sigma; with 1 the error after the update is r^2 / e. A value out of range, or a recursion that diverges, raises an
    InputError.
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
        for name, value, most, rule in (
            ("eta", eta, MOST, "(0, inf)"),
            ("mu", mu, 1.0, "(0, 1]"),
            ("dead_zone", dead_zone, MOST, "(0, inf)"),
            ("fraction", fraction, 1.0, "(0, 1]"),
        ):
            if value is not None and not 0 < value <= most:
                raise InputError(
                    f"The {name!r} parameter of recursive least squares must be in {rule}. Got {value} instead."
                )
        start = np.zeros(n) if theta is None else np.asarray(theta, dtype=np.float64)
        if start.shape != (n,):
            raise InputError(f"The 'theta' array must have shape ({n},). Got {start.shape} instead.")
        self.n, self.dead_zone, self.samples = n, dead_zone, 0
        values: dict[str, Value] = {"theta0": start, "eta": eta, "mu": mu, "form": "plain"}
        if dead_zone is not None:
            values |= {"form": "corrected", "r": dead_zone, "share": fraction}
        graph = Graph.single(Node("learner", "recursive_least_squares", {"n": n}, values))
        self._block = graph.executor()
        self._at = {port.name: port.reference for port in graph.ports}
        self._first = start

    @property
    def theta(self) -> Array:
        """Parameters (n,)."""
        if self.samples == 0:
            return self._first
        return np.array([self._block.get(self._at["theta"] + i) for i in range(self.n)])

    def update(self, phi: Array, y: float) -> float:
        """Update the parameters with one sample.

        The regressor phi is h(k), shape (n,). The error before the update is e(k) = y - phi' theta(k-1). A value that
        is not finite, another length, or a recursion that diverges raises an InputError.
        """
        h = np.asarray(phi, dtype=np.float64)
        if h.shape != (self.n,):
            raise InputError(f"The 'phi' array must have shape ({self.n},). Got {h.shape} instead.")
        if not (np.isfinite(h).all() and np.isfinite(y)):
            bad = next(float(v) for v in [*h, y] if not np.isfinite(v))
            raise InputError(f"sample {self.samples}: The values of phi and y must be finite. Got {bad} instead.")
        block, at = self._block, self._at
        for i, value in enumerate(h.tolist(), at["phi"]):
            block.set(i, value)
        block.set(at["y"], y)
        if self.samples == 0:
            before = 0.0
            block.start(0.0)  # the block learns from the first sample, too
        else:
            before = block.get(at["learned"])
            block.step(float(self.samples), 1.0)
        self.samples += 1
        e = float(y - block.get(at["y_hat"]))
        if not block.get(at["learned"]) > before and not (self.dead_zone is not None and abs(e) <= self.dead_zone):
            reason = (
                "" if self.dead_zone is None else f": the dead zone {self.dead_zone:g} is below the achievable error"
            )
            raise InputError(f"Recursive least squares must converge. It diverged at sample {self.samples}{reason}.")
        return e
