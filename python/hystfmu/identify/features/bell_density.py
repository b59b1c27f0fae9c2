"""Preisach density whose logarithm is smooth, before a static nonlinearity that need not be monotone.

  y = b(v),  v = w x + integral over alpha >= beta of mu(alpha, beta) relay_{alpha, beta}[x],  mu = exp(l(m, d))

b is a polynomial, m is the mean of the thresholds of a relay, and d is half of their difference. l is a sum of products
of B-splines. Penalties on its third differences over m and over d keep it smooth, and a polynomial of degree 2 has no
penalty. Therefore few reversals determine a bell-shaped density, as that of ferroelectric and ferromagnetic materials
(Della Torre, Magnetic Hysteresis, 1999, ch. 2). With an even b, y is a butterfly loop: the strain of a ferroelectric is
nearly the square of its polarisation.

The relays start from the demagnetised state at the input `centre`, which is also searched: a small remanent v before
the record changes all loops until the first large one. The output of the relays is linear in the Everett function at
the nodes of the grid. Its derivative with respect to the centre is a finite difference. The coefficients of b are
linear parameters (variable projection, Golub & Pereyra 1973; Kaufman 1975). The search begins with bell curves (degree
2) from a few start values, because an even b has many local minima.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import legendre

from hystfmu.base import Array, Indices, Mask
from hystfmu.graph import Graph, Node
from hystfmu.graph.splines import uniform_splines
from hystfmu.identify.estimate.runs import Runs
from hystfmu.identify.features.smooth_density import triangles
from hystfmu.identify.solvers.trust_region import Coordinates, Differences, refined

HELD = 1e-9  # range of the shift of the centre in the search of all coefficients
MARGIN = 0.1  # distance of the grid from the largest input, relative to half of its range
SPLINES = 12  # number of B-splines of m and of d
# start values of a bell curve, relative to half of the range: d and its standard deviation, and that of m
BELLS = tuple((d, of_d, of_m) for d in (0.15, 0.3, 0.5, 0.7) for of_d in (0.12, 0.3) for of_m in (0.15, 0.35))
TRIED = 3  # number of start values from which a search begins
DEEPEST, HIGHEST = -40.0, 20.0  # range of l
SAME = 0.01  # standard deviation of ln of the integral of mu: the scale of v has no effect on y
MOST = 5.0  # largest w, relative to the integral of mu
SHIFT = 0.02  # finite difference of the centre, relative to half of the grid
EVALUATIONS, TOLERANCE = (40, 25), 1e-5  # limits of a search: of a bell curve, of l
ROUGH = 1e-2  # tolerance of a search of l whose result is only compared with others


@dataclass(frozen=True)
class Bell:
    """A fitted model for x in [-1, 1]: centre, weight w, coefficients l (p,) of ln mu, Legendre coefficients q of b(v).

    v is divided by `size`, so that it lies in [-1, 1].
    """

    centre: float
    w: float
    ln_mu: Array
    q: Array
    size: float = 1.0


Part = tuple[Array, Indices]
"""Input x (n,) of a record, and the rows of this record that are seen."""


class Relays:
    """Relays on a grid with n steps about a centre, for the inputs of some records, seen on some of their rows."""

    def __init__(
        self, parts: Sequence[Part], n: int, centre: float, start: str, moves: bool, half: float = 0.0
    ) -> None:
        self.n, self.centre, self.start, self.moves = n, centre, start, moves
        self.half = half or max(float(np.abs(x - centre).max()) for x, _ in parts) * (1 + MARGIN)
        up, down = np.tril_indices(n)
        self.d, self.m = (up - down) / n, (up + down + 1) / n - 1  # relative to half of the grid
        self.inner = up > down
        of_m, of_d = (uniform_splines(v, SPLINES) for v in (self.m, 2 * self.d - 1))
        self.basis = (of_d[:, :, None] * of_m[:, None, :]).reshape(len(up), -1)
        self.everett = triangles(n)
        self.line = self.everett @ ~self.inner / n  # an equal density on the diagonal: the output follows the input
        self.seen = self._seen(parts, 0.0)
        self.moved = (self._seen(parts, SHIFT) - self.seen) / SHIFT if moves else 0 * self.seen

    def _seen(self, parts: Sequence[Part], shift: float) -> Array:
        """Return the derivatives (rows, nodes) of the output with respect to the Everett function, for a shift."""
        runs = Runs(Graph.single(self.node("relays", 0 * self.line, shift)))
        changes = [{"relays.E": unit} for unit in np.eye(len(self.line))]
        return np.vstack([runs.sensitivities(x[:, None], 1.0, changes, rows, 1.0)[1] for x, rows in parts])

    def on(self, rows: Mask) -> "Relays":
        """Return the relays seen on some of the rows."""
        other = copy(self)
        other.seen, other.moved = self.seen[rows], self.moved[rows]
        return other

    def node(self, name: str, E: Array, shift: float = 0.0) -> Node:
        """Return a block ``preisach`` with the Everett function E; `shift` moves the centre, relative to `half`."""
        lo, hi = (self.centre + (shift + side) * self.half for side in (-1, 1))
        values: dict[str, Any] = {"lo": lo, "hi": hi, "E": E, "start": self.start}
        return Node(name, "preisach", {"n": self.n}, values)

    def density(self, ln_mu: Array) -> Array:
        """Return the density in all cells, shape (cells,)."""
        return np.where(self.inner, np.exp(np.clip(self.basis @ ln_mu, DEEPEST, HIGHEST)), 0.0)

    def bell(self, d: float, of_d: float, m: float, of_m: float) -> Array:
        """Return the coefficients of ln mu of a bell curve."""
        at = (np.arange(SPLINES) - 0.5) * 2 / (SPLINES - 2) - 1  # coefficients of a parabola: its values there
        curves = -0.5 * (((at + 1) / 2 - d) / of_d) ** 2, -0.5 * ((at - m) / of_m) ** 2
        ln_mu = np.add.outer(*curves).ravel()
        return ln_mu - float(np.log(self.density(ln_mu).sum()))  # the B-splines have the sum 1

    def v(self, shift: float, w: float, ln_mu: Array) -> Array:
        """Return v (rows,) for a centre that is moved by `shift`."""
        E = self.everett @ self.density(ln_mu) + w * self.line
        return (self.seen + shift * self.moved) @ E

    def slopes(self, shift: float, w: float, ln_mu: Array) -> Array:
        """Return the derivatives of v with respect to the shift, w and `ln_mu`, shape (rows, 2 + p)."""
        mu = self.density(ln_mu)
        E = self.everett @ mu + w * self.line
        by_ln_mu = self.everett @ (mu[:, None] * self.basis)
        seen = self.seen + shift * self.moved
        return np.column_stack([self.moved @ E, seen @ np.column_stack([self.line, by_ln_mu])])


class Problem:
    """Residuals of y (rows,) in units of its noise `sigma`, followed by the penalties, for a polynomial b."""

    def __init__(self, relays: Relays, y: Array, degree: int, smooth: float, sigma: float) -> None:
        self.relays, self.y, self.degree, self.sigma = relays, y, degree, sigma
        third, one = np.diff(np.eye(SPLINES), 3, axis=0) / smooth, np.eye(SPLINES)
        held = np.vstack([np.kron(third, one), np.kron(one, third)])
        self.penalty = np.hstack([np.zeros((len(held), 2)), held])
        free = np.full(SPLINES**2, np.inf)
        lo, hi = np.concatenate([[-HELD, 0.0], -free]), np.concatenate([[HELD, MOST], free])
        self.coordinates = Coordinates(lo, hi, np.append([SHIFT, 0.1], np.ones(SPLINES**2)), lambda p: {})

    def _projected(self, p: Array) -> tuple[Array, Array, Array, float]:
        """Return the residuals of y, the coefficients q, an orthonormal basis of the polynomials of v, and its size."""
        v = self.relays.v(p[0], p[1], p[2:])
        size = float(np.abs(v).max()) or 1.0
        columns = legendre.legvander(v / size, self.degree)
        Q, R = np.linalg.qr(columns)
        q = np.linalg.lstsq(R, Q.T @ self.y, rcond=None)[0]
        return columns @ q - self.y, q, Q, size

    def residuals(self, p: Array) -> Array:
        """Return the residuals and the penalties at a point p: shift of the centre, w and l."""
        total = np.log(self.relays.density(p[2:]).sum())
        return np.concatenate([self._projected(p)[0] / self.sigma, self.penalty @ p, [total / SAME]])

    def jacobian(self, p: Array) -> Array:
        """Return the derivatives of `residuals`."""
        _, q, Q, size = self._projected(p)
        v = self.relays.v(p[0], p[1], p[2:]) / size
        turned = (legendre.legval(v, legendre.legder(q)) / size)[:, None] * self.relays.slopes(p[0], p[1], p[2:])
        mu = self.relays.density(p[2:])
        total = np.append([0.0, 0.0], mu @ self.relays.basis / mu.sum())
        return np.vstack([(turned - Q @ (Q.T @ turned)) / self.sigma, self.penalty, total / SAME])

    def at(self, p: Array) -> Bell:
        """Return the model at a point of the search."""
        _, q, _, size = self._projected(p)
        return Bell(self.relays.centre + float(p[0]) * self.relays.half, float(p[1]), p[2:], q, size)

    def started(self) -> Bell:
        """Return the best bell curve."""

        def point(z: Array) -> Array:
            bell = self.relays.bell(float(z[0]), float(np.exp(z[1])), float(z[2]), float(np.exp(z[3])))
            return np.concatenate([z[4:], bell])

        def misfit(z: Array) -> Array:
            e = self._projected(point(z))[0]
            return np.asarray(e / np.sqrt(len(e)))

        reach = 3 * SHIFT if self.relays.moves else HELD
        lo = np.array([-0.2, np.log(0.02), -0.5, np.log(0.02), -reach, 0.0])
        hi = np.array([1.2, np.log(3.0), 0.5, np.log(3.0), reach, MOST])
        starts = [np.array([d, np.log(a), 0.0, np.log(b), 0.0, 0.1]) for d, a, b in BELLS]
        starts = sorted(starts, key=lambda z: float(np.sum(misfit(z) ** 2)))[:TRIED]
        search = Differences(misfit, np.array([0.1, 0.3, 0.1, 0.3, 0.02, 0.1]), (lo, hi))
        found = min((refined(search, z, EVALUATIONS[0], TOLERANCE) for z in starts), key=lambda f: f.cost)
        return self.at(point(found.p))

    def fitted(self, start: Bell, tolerance: float = TOLERANCE) -> Bell:
        """Return the result of a search of all coefficients from a start point with the same centre."""
        p = np.concatenate([[0.0, start.w], start.ln_mu])
        return self.at(refined(self, p, EVALUATIONS[1], tolerance).p)

    def errors(self, bell: Bell) -> Array:
        """Return the errors of a model with the centre of the relays, shape (rows,)."""
        v = self.relays.v(0.0, bell.w, bell.ln_mu) / bell.size
        return np.asarray(legendre.legval(v, bell.q) - self.y)

    def node(self, bell: Bell) -> Node:
        """Return the block of v, scaled to [-1, 1]."""
        r = self.relays
        return r.node("hysteresis", (r.everett @ r.density(bell.ln_mu) + bell.w * r.line) / bell.size)
