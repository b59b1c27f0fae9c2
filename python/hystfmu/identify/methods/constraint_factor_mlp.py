"""Network of Shen & Ma 2017 (2-5-1) with two inputs: x, and the output h of the constraint-factor operator of x.

The operator is fitted first, and then the network. The options ``branch = literal`` and ``memory = last`` give the
method of the paper. The option ``sweep`` compares networks with 1, 2, ... hidden neurons, and uses the number with the
smallest error on a validation split, which is the last 30 % of the training rows.

Each branch of the operator has the shape g(d) = (1 - e^-d)(a_0 + sum_j a_j d^(2j-1)). The start of a branch and the
distance d from this start depend only on the input. Therefore the operator is linear in the coefficients: h = sum_j a_j
H_j, where H_j is the operator with the branch b_j(d) = (1 - e^-d) d^(2j-1) (b_0 = 1 - e^-d). The columns H_j are
orthogonalised by a singular value decomposition. The slope g' must be positive on a grid. The fit with this constraint
is a least-distance problem (Lawson & Hanson 1974, ch. 23). A small penalty on the third derivative keeps g smooth where
the data do not determine it.

Shen & Ma 2017, eq. 1-10, fit the increments from the last extremum by normal equations (`literal_branch`). Normal
equations square the condition number, which is already large. The paper has no constraint that keeps the branch
increasing: the printed a_0 = g'(0) is negative.
"""

from dataclasses import dataclass

import numpy as np

from hystfmu.base import Array, Progress
from hystfmu.data import Dataset
from hystfmu.data.dataset import Rows
from hystfmu.graph import Graph, Node
from hystfmu.identify.catalogue import CLOSES, Candidate, Option, Options, Row, scaled_input
from hystfmu.identify.features.plays import branch_option, u0_of, u0_option
from hystfmu.identify.features.straightened import straightened
from hystfmu.identify.methods.operator_networks import BEND
from hystfmu.identify.network.readout import QUICK, Features, fit_readout, hidden_sweep, network_options
from hystfmu.identify.solvers.nonnegative import least_distance

TEXT = "constraint-factor operator and a network on (x, h)"
LEAST_SLOPE = 1e-3  # smallest slope on the grid, relative to the mean slope; g then also increases between grid points
GRID = 400
DEPENDENT = 1e-9  # relative singular value below which a combination of columns is not determined
SHARE = 0.7  # share of the training rows to which a sweep fits; the other rows are the validation split

CANDIDATES = (Candidate(CLOSES, 0.3, 0.1, quick=QUICK),)
OPTIONS = (
    Option("m", 9, 1, 20, text="number of odd powers in the polynomial of the branch"),
    Option(
        "branch",
        "increasing",
        choices=("increasing", "literal"),
        text="least squares over increasing branches; literal: the paper's normal equations",
    ),
    branch_option(),
    Option("roughness", 1e-4, 0.0, 1e3, text="penalty on the third derivative of the branch"),
    BEND,
    Option("range", 1.0, 1e-6, 10.0, text="range that the input is scaled to before the operator"),
    Option("sweep", 0, 0, 1000, text="largest number of hidden neurons that is tried; with 0, `hidden` is used"),
    u0_option("the operator rests"),
    *network_options(hidden=5, starts=3, iterations=230),
)


@dataclass(frozen=True)
class Branch:
    """A fitted branch function g.

    ``a`` contains the coefficients a_0, a_1, ..., a_m. ``d_max`` is the length of the longest branch in the data.
    ``condition`` is the condition number of the least-squares system with columns of norm 1. For `literal_branch` it is
    that of the normal equations.
    """

    a: Array
    d_max: float
    condition: float

    def __call__(self, d: Array) -> Array:
        """Return g(d) for d (n,)."""
        return np.asarray(basis(d, len(self.a) - 1) @ self.a)

    def slope(self, d: Array) -> Array:
        """Return g'(d) for d (n,)."""
        return np.asarray(basis_derivatives(d, len(self.a) - 1) @ self.a)

    @property
    def falling(self) -> float:
        """Fraction of [0, d_max] on which the branch decreases."""
        return float(np.mean(self.slope(np.linspace(0, self.d_max, 10 * GRID + 1)) < 0))


def basis(d: Array, m: int, d_max: float = np.inf) -> Array:
    """Return b_0 = 1 - e^-d and b_j = (1 - e^-d) d^(2j-1), j = 1..m, at d (n,), shape (n, m + 1).

    Above d_max, the functions continue as straight lines.
    """
    near = np.minimum(d, d_max)
    b = -np.expm1(-near)[:, None] * _powers(near, m)
    far = d > d_max
    if far.any():
        b[far] += (d[far] - d_max)[:, None] * basis_derivatives(near[far], m)
    return np.asarray(b)


def basis_derivatives(d: Array, m: int) -> Array:
    """Return the derivatives of the basis at d (n,) up to d_max; shape (n, m + 1)."""
    j = np.arange(1, m + 1)
    derivative = np.column_stack([np.zeros_like(d), (2 * j - 1) * d[:, None] ** (2 * j - 2)])
    return np.asarray(np.exp(-d)[:, None] * _powers(d, m) - np.expm1(-d)[:, None] * derivative)


def _powers(d: Array, m: int) -> Array:
    return np.column_stack([np.ones_like(d), d[:, None] ** (2 * np.arange(1, m + 1) - 1)])


@dataclass(frozen=True)
class StackCoordinates:
    """Position of each row (n,) on its branch; the operator output is h[k] = h[start[k]] + weight[k] g(d[k]).

    `start` is the row of the extremum at which the branch starts; -1 is the origin, where h = 0. `weight` is the sign
    of the branch, and d is the distance from the extremum. On the virgin branch the weight is halved and d is doubled
    (Masing: h = sgn(x - x0) g(2 |x - x0|) / 2).
    """

    start: np.typing.NDArray[np.int_]
    weight: Array
    d: Array

    def columns(self, m: int, d_max: float) -> Array:
        """Return the outputs H_j (j = 0..m) of the operator with basis function j as its branch, shape (n, m + 1).

        The basis functions continue as straight lines above `d_max`.
        """
        steps = self.weight[:, None] * basis(self.d, m, d_max)
        H = np.zeros((len(steps) + 1, m + 1))  # the last row is the origin
        for k, p in enumerate(self.start):
            H[k] = H[p] + steps[k]
        return H[:-1]


def stack_coordinates(x: Array, x0: float, memory: str = "dominant") -> StackCoordinates:
    """Return the branch positions of an input x (n,) from rest at x0.

    With the `memory` "dominant", the operator has return-point memory. With "last", it remembers only the last
    extremum.
    """
    n = len(x)
    start, weight, d = np.full(n, -1), np.zeros(n), np.zeros(n)
    extrema: list[int] = []
    last, direction = x0, 0.0
    for k in range(n):
        if x[k] == last:  # a plateau is not a reversal
            if k:
                start[k], weight[k], d[k] = start[k - 1], weight[k - 1], d[k - 1]
            continue
        s = 1.0 if x[k] > last else -1.0
        if direction * s < 0:
            extrema.append(k - 1)
        if memory == "dominant":
            while len(extrema) >= 2 and s * x[k] >= s * x[extrema[-2]]:
                del extrema[-2:]
            if len(extrema) == 1 and (x[k] - x0) * s >= (x0 - x[extrema[0]]) * s:
                extrema.clear()
        if extrema:
            start[k], weight[k], d[k] = extrema[-1], s, s * (x[k] - x[extrema[-1]])
            if d[k] < 0:  # x passed the last extremum after a plateau; happens only without return-point memory
                weight[k], d[k] = -s, -d[k]
        else:
            virgin = 2.0 if memory == "dominant" else 1.0
            weight[k], d[k] = np.copysign(1 / virgin, x[k] - x0), virgin * abs(x[k] - x0)
        last, direction = x[k], s
    return StackCoordinates(start, weight, d)


def increasing_branch(where: StackCoordinates, y: Array, free: Array, rows: Rows, m: int, roughness: float) -> Branch:
    """Fit an increasing branch so that the operator plus a combination of the columns `free` approximates y on `rows`.

    `where` contains the branch positions of all rows. y (n,) is the target on the n rows `rows`. `free` (n, q) contains
    columns with free weights, including a constant column. m is the number of odd powers. `roughness` is the weight of
    the RMS third derivative of g relative to the RMS error.
    """
    d_max = float(where.d[rows].max())
    H = where.columns(m, d_max)[rows]
    Q = np.linalg.svd(free, full_matrices=False)[0]
    third = d_max * (GRID - 1) ** 2 * np.diff(basis_derivatives(np.linspace(0, d_max, GRID), m), 2, axis=0)
    system = np.vstack([H - Q @ (Q.T @ H), roughness * np.sqrt(len(H) / len(third)) * third])
    size = np.linalg.norm(system, axis=0)
    U, sigma, Vt = np.linalg.svd(system / size, full_matrices=False)
    keep = sigma > DEPENDENT * sigma[0]
    back = Vt[keep].T / sigma[keep] / size[:, None]  # from the orthogonal basis to a
    grid = 0.5 * d_max * (1 - np.cos(np.linspace(0, np.pi, GRID)))
    least = LEAST_SLOPE * float(np.ptp(y)) / d_max
    z = _nearest(U[: len(H), keep].T @ y, basis_derivatives(grid, m) @ back, np.full(GRID, least))
    return Branch(back @ z, d_max, float(sigma[0] / sigma[keep][-1]))


def _nearest(f: Array, E: Array, least: Array) -> Array:
    """Return the vector z nearest to f with E z >= `least`."""
    if (E @ f >= least).all():
        return f
    size, scale = np.linalg.norm(E, axis=1), float(np.linalg.norm(f))
    d = least_distance((E / size[:, None]).T, (least - E @ f) / size / scale)
    return f if d is None else f + scale * d


def literal_branch(where: StackCoordinates, y: Array, rows: Rows, m: int) -> Branch:
    """Fit the branch to increments of y (n,) by normal equations, as in Shen & Ma 2017, eq. 8-10.

    The increments begin at the extremum at which a branch starts (`where`). The fit uses the rows `rows` and m odd
    powers.
    """
    every = np.arange(len(where.start))[rows]
    used = every[where.start[every] >= 0]
    v = np.sign(where.weight[used]) * (y[used] - y[where.start[used]])
    B = basis(where.d[used], m)
    X = B.T @ B
    return Branch(np.linalg.inv(X) @ (B.T @ v), float(where.d[used].max()), float(np.linalg.cond(X)))


def fit_operator(data: Dataset, options: Options) -> tuple[Features, Branch]:
    """Fit ``scaling -> constraint_factor``; return the network inputs x and h (features), and the fitted branch."""
    u, y, rows = data.u, data.y, data.counted
    u0 = u0_of(data, options)
    scaling, gain, offset = scaled_input(u[data.train], options["range"])
    x, x0 = gain * u + offset, gain * u0 + offset
    where = stack_coordinates(x, x0, options["memory"])
    if options["branch"] == "literal":
        branch = literal_branch(where, y / data.span, rows, options["m"])
    else:
        v, free = straightened(x[rows], y[rows], options["bend"], data.covariates.values[rows])
        branch = increasing_branch(where, v, free, rows, options["m"], options["roughness"])
    values = {"a0": branch.a[0], "a": branch.a[1:], "d_max": branch.d_max, "memory": options["memory"], "x0": x0}
    nodes = [scaling, Node("operator", "constraint_factor", {}, values)]
    ends = ["input.y", "operator.h"]
    return Features(nodes, [("input.y", "operator.x")], ["input.u"], ends, data), branch


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit ``scaling -> constraint_factor -> scaling -> mlp -> scaling``; return graph and number of parameters."""
    front, branch = fit_operator(data, options)
    chosen, began = dict(options), 0.0
    if options["sweep"]:
        first, end = data.train.start, data.train.stop
        middle = first + round(SHARE * (end - first))
        scores = hidden_sweep(
            front.values,
            data.y,
            slice(first, middle),
            slice(middle, end),
            range(1, options["sweep"] + 1),
            options,
            seed,
            lambda f: progress(0.95 * f),
        )
        chosen["hidden"], began = min(scores, key=lambda n: scores[n]), 0.95
    graph, parameters, _ = fit_readout(front, data, chosen, seed, lambda f: progress(began + (1 - began) * f))
    return graph, parameters + len(branch.a)


KINDS = {"constraint_factor_mlp": Row(TEXT, build, OPTIONS, CANDIDATES, covariates=True)}
