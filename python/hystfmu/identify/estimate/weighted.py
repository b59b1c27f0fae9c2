"""Search for linear dynamics after a weighted sum of signals, whose weights are fitted for each trial of the dynamics.

The derivatives of the residuals with respect to the dynamics are those of Kaufman (see `objective`): they need one
filtered signal per parameter, the weighted sum.
"""

from collections.abc import Callable

import numpy as np

from hystfmu.base import Array, Indices, Mask, Progress
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise
from hystfmu.identify.catalogue import Options
from hystfmu.identify.estimate.dynamics import Beside, Dynamics, bounds
from hystfmu.identify.evidence import Evidence, evidence
from hystfmu.identify.solvers.trust_region import Differences, refined, standard_errors

RATED = 1500  # minimum number of rows on which start points are compared; more rows are thinned evenly
DEPENDENT = 1e-10  # relative singular value of normalised columns below which a combination counts as dependent
MOST_ROWS = 60_000  # maximum number of rows of a record whose modes are identified before the fit
TRIALS = 11  # number of start values of f_n, over at most four decades
MOST_EVALUATIONS = 40  # maximum number of evaluations of residuals and Jacobian per start value
TOLERANCE = 1e-9  # relative change that ends a search
NOISY = 1.05  # ratio of residuals to noise up to which a further start point cannot reduce the residuals

_SHOWN: dict[tuple[str | int, ...], Evidence] = {}


class Weighted:
    """Signals before the dynamics, whose weighted sum after the dynamics approximates the output on some rows.

    `columns` (n, m) contains the signals. `fit` returns the weights (m,) of the filtered signals (rows, m) for an
    output (rows,), and the weights that a small change of the dynamics also changes, as a mask (m,).
    """

    def __init__(
        self,
        columns: Array,
        data: Dataset,
        rows: Indices,
        hold: str,
        fit: Callable[[Array, Array], tuple[Array, Mask]],
    ) -> None:
        self.columns, self.data, self.rows, self.hold, self.fit = columns, data, rows, hold, fit
        self._last: tuple[Dynamics | None, Array, Array, Array] = None, columns, columns, columns

    def thinned(self) -> "Weighted":
        """Return the problem on at least `RATED` rows, if there are as many."""
        rows = self.rows[:: max(1, len(self.rows) // RATED)]
        return Weighted(self.columns, self.data, rows, self.hold, self.fit)

    def project(self, g: Dynamics) -> tuple[Array, Array, Array]:
        """Return the residuals (rows,) for the dynamics g, the weights (m,), and the columns of weights that change."""
        if self._last[0] != g:
            seen, y = g.filter(self.columns, self.data.h, self.hold, self.rows), self.data.y[self.rows]
            weights, moves = self.fit(seen, y)
            self._last = g, seen @ weights - y, weights, seen[:, moves]
        return self._last[1:]

    def differences(self, beside: Beside, limits: tuple[Array, Array]) -> Differences:
        """Return the residuals, relative to the span of y, as a function of the point of a search between `limits`."""
        h, size = self.data.h, self.data.span * np.sqrt(len(self.rows))

        def held(p: Array) -> tuple[Callable[[Array], Array], Array]:
            _, weights, moving = self.project(Dynamics.at(p, h, beside))
            total = (self.columns @ weights)[:, None]
            U, s, _ = np.linalg.svd(moving / np.maximum(np.linalg.norm(moving, axis=0), 1e-300), full_matrices=False)

            def run(q: Array) -> Array:
                return np.asarray(Dynamics.at(q, h, beside).filter(total, h, self.hold, self.rows)[:, 0] / size)

            return run, np.asarray(U[:, s > DEPENDENT * s.max(initial=0.0)])

        def residuals(p: Array) -> Array:
            return np.asarray(self.project(Dynamics.at(p, h, beside))[0] / size)

        return Differences(residuals, np.ones(len(limits[0])), limits, held=held)


def search(
    weighted: Weighted, data: Dataset, options: Options, progress: Progress, near: Dynamics | None = None
) -> Dynamics:
    """Return the dynamics that minimise the residuals, by trust-region steps from `near`.

    Without `near`, the search begins at the best start point of a grid of natural frequencies. If the residuals then
    exceed the noise, it also begins at the best other start point: a point of the grid, or the modes that the record
    shows.
    """
    h, (lo, hi) = data.h, bounds(data, options)
    rough = weighted.thinned()

    def problem(of: Weighted, beside: Beside) -> Differences:
        return of.differences(beside, (np.append(lo, -np.ones(len(beside))), np.append(hi, np.ones(len(beside)))))

    def rated(start: tuple[Array, Beside]) -> float:
        at = problem(rough, start[1])
        return float(np.sum(at.residuals(at.coordinates.inside(_point(*start))) ** 2))

    def refine(start: tuple[Array, Beside]) -> tuple[float, Dynamics]:
        found = refined(problem(weighted, start[1]), _point(*start), MOST_EVALUATIONS, TOLERANCE)
        return found.misfit, Dynamics.at(found.p, h, start[1])

    if near is not None:
        return refine((near.point(h), near.beside))[1]
    grid = np.linspace(hi[0], max(lo[0], hi[0] + np.log(1e-4)), TRIALS)
    starts: list[tuple[Array, Beside]] = [(np.array([f, np.log(0.7), d]), ()) for f in grid for d in (0.0, 2.0)]
    first, second, *_ = sorted(starts, key=rated)
    progress(0.3)
    found = refine(first)
    progress(0.65)
    if found[0] * data.span > NOISY * noise(data.y[data.counted]):
        # a lightly damped resonance can lie between two frequencies of the grid
        shown: list[tuple[Array, Beside]] = [(mode.point(h), mode.beside) for mode in _modes(data)]
        found = min(found, refine(min([second, *shown], key=rated)), key=lambda f: f[0])
    progress(1.0)
    return found[1]


def _point(p: Array, beside: Beside) -> Array:
    return np.append(p, [share for *_, share in beside])


def _modes(data: Dataset) -> list[Dynamics]:
    """Return start points of the search: dynamics with each mode that the record shows, and with all modes.

    For a record with more than `MOST_ROWS` rows, there are no such start points.
    """
    if len(data.u) > MOST_ROWS:
        return []
    key = tuple(data.identity)
    if (shown := _SHOWN.get(key)) is None:  # candidates of ``auto`` and folds share a record
        shown = evidence(data)
        _SHOWN.clear()
        _SHOWN[key] = shown
    late = shown.delay if np.isfinite(shown.delay_se) else 0.0
    found = [Dynamics(m.f_n, m.zeta, late) for m in shown.modes]
    if len(shown.modes) > 1:
        total = sum(m.share for m in shown.modes)
        first, *others = sorted(shown.modes, key=lambda m: -m.share)
        found.append(Dynamics(first.f_n, first.zeta, late, tuple((m.f_n, m.zeta, m.share / total) for m in others)))
    return found


def uncertainty(weighted: Weighted, g: Dynamics, data: Dataset, options: Options) -> Array:
    """Return the standard errors (3,) of ln f_n, ln zeta and the delay (samples) of the identified dynamics `g`."""
    lo, hi = bounds(data, options)
    near, p = weighted.differences(g.beside, (lo, hi)), np.clip(g.point(data.h), lo, hi)
    return standard_errors(near.residuals(p), near.jacobian(p), ~near.coordinates.at_bounds(p))
