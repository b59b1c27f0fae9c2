"""Duhem model: slopes depend on output and direction, for static loops without return-point memory.

  y = c + k u + w,   dw/du = sum_{i<=m} u^i (a_i + sum_{j<=q} (b_ij w^j + c_ij |w| w^(j-1))),  rising and falling apart.

The increments of the output give start values (`hystfmu.identify.features.slopes`).  From there all parameters and w at
the first row are refined on the free run, in the orthonormal basis of the increments, because the powers themselves are
nearly dependent.  Oh & Bernstein, IEEE Trans. Autom. Control 50 (2005) 631-645.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.candidate import OPENS, Candidate, Memory
from hystfmu.identify.estimate.coordinates import Coordinates
from hystfmu.identify.estimate.determined import determined
from hystfmu.identify.estimate.objective import Objective
from hystfmu.identify.estimate.search import Found, refined
from hystfmu.identify.features import dead_band
from hystfmu.identify.features.slopes import Slopes
from hystfmu.identify.options import Option

TEXT = "polynomial slopes for rising and falling input, least squares, refined on the free run"
MEMORY = Memory(1700.0, "q")
EVALUATIONS = 34  # limit on evaluations of residuals and Jacobian on the free run
TOLERANCE = 1e-8  # relative change that ends the refinement
PIECE = 5.0  # length of a piece of the path in dead bands: the noise at its ends is an eighth of it
CLOSE = 0.025  # RMS error, relative to the span, from which on no other start is refined
ROOM = 3.0  # bound of |w|, relative to the largest in the data

CANDIDATES = (Candidate(OPENS, 0.2, 0.5),)
OPTIONS = (
    Option("m", 0, 0, 6, text="degree of the slope in the input"),
    Option("q", 5, 1, 10, text="degree of the slope in the output"),
    dead_band.OPTION,
)


def coefficients(theta: list[Array], m: int, q: int) -> dict[str, Array]:
    """Return the values of the block for the slopes of rising and of falling u, each (terms,)."""
    found: dict[str, Array] = {}
    for end, of in zip(("rise", "fall"), theta, strict=True):
        by_power = of.reshape(m + 1, 2 * q + 1)
        found |= {f"a_{end}": by_power[:, 0], f"b_{end}": by_power[:, 1 : q + 1], f"c_{end}": by_power[:, q + 1 :]}
    return {name: value.ravel() for name, value in found.items()}


def build(
    data: Dataset, options: Mapping[str, Any], seed: int, progress: Callable[[float], None]
) -> tuple[Graph, int, dict[str, Any]]:
    """Build the graph ``scaling -> duhem -> scaling``; return it with the number of its parameters and what is known.

    Raises
    ------
    InputError
        There are fewer rows of rising or of falling input than coefficients.
    """
    rows, counted, m, q = data.train, data.counted, options["m"], options["q"]
    seen = data.u[: rows.stop]  # later rows do not affect the training rows
    middle, half = (seen.max() + seen.min()) / 2, np.ptp(seen) / 2
    u = (seen - middle) / half
    centre, size = float(data.y[counted].mean()), data.span / 2
    y = (data.y[rows] - centre) / size
    kept = np.zeros(len(data.u), dtype=bool)
    kept[counted] = True
    kept = kept[rows]
    slopes = Slopes(u[rows], y, kept, m, q, PIECE * options["dead_band"] / half)
    if min(map(len, slopes.parts)) < slopes.terms:
        rises, falls = map(len, slopes.parts)
        raise InputError(
            f"{data.path or data.name}: The train rows for duhem with m = {m}, q = {q} must have at least "
            f"{slopes.terms} rows of rising and of falling u. Got {rises} and {falls} instead."
        )
    ends = Node("input", "scaling", {"n": 1}, {"gain": 1 / half, "offset": -middle / half})
    readout = Node("readout", "scaling", {"n": 1}, {"gain": size})
    wires = [("input.y", "operator.u"), ("operator.y", "readout.u")]
    ports = [Input("u", ("input.u",), data.unit_u, float(data.u[0]))], [Output("y", "readout.y", data.unit_y)]

    def free_run(k: float, c: float) -> Objective:
        """Return the objective around the slopes of the increments for k and c."""
        theta, factors, _ = slopes.solve(k, c)
        w = (y - k * u[rows] - c)[kept]
        w_max = ROOM * float(np.abs(w).max())
        first = float(w[0]) if kept[0] and rows.start == 0 else 0.0

        def values(x: Array) -> dict[str, ArrayLike]:
            changed = [t + f @ d for t, f, d in zip(theta, factors, np.split(x[3:], 2), strict=True)]
            own = {**coefficients(changed, m, q), "k": k + x[0], "w0": np.clip(first + x[2], -w_max, w_max)}
            found = {f"operator.{name}": value for name, value in own.items()}
            return {**found, "readout.offset": centre + size * (c + x[1])}

        operator = Node("operator", "duhem", {"m": m, "q": q}, {"w_max": w_max, "u0": float(u[0])})
        n = 3 + 2 * slopes.terms
        moved = Coordinates(np.full(n, -np.inf), np.full(n, np.inf), np.ones(n), values)
        return Objective(data, Graph([ends, operator, readout], wires, *ports), moved)

    line = np.linalg.lstsq(np.column_stack([u[rows], np.ones(len(y))])[kept], y[kept], rcond=None)[0]
    tries = [free_run(*start) for start in slopes.starts(line[0], lambda f: progress(0.3 * f))]
    # the increments may be followed best by slopes whose free run leaves the data: the free run decides
    still = np.zeros(3 + 2 * slopes.terms)
    best: tuple[Found, Objective] | None = None
    for i, objective in enumerate(sorted(tries, key=lambda o: float(np.sum(o.residuals(still) ** 2)))):
        progress(0.3 + 0.6 * i / len(tries))
        found = refined(objective, still, EVALUATIONS, TOLERANCE, by_jacobian=True)
        if best is None or found.cost < best[0].cost:
            best = found, objective
        if found.misfit < CLOSE:
            break
    assert best is not None
    found, objective = best
    return objective.graph(found.p), len(still), {"free": determined(objective, found.p).table}
