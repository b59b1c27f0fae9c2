"""Numerical tests of lemmas, remarks and theorems of Zhao & Tan 2008: examples and counterexamples.

In the literal replica, a branch starts at the last extremum, and the inverse operator is reconstructed from remarks in
the paper. In our method, a branch starts at the last extremum that is not wiped out (dominant extremum), and the
inverse of eq. 1 is exact. The hysteresis consists of the ten backlash operators of section II.
"""

import numpy as np

from hystfmu.base import Array
from hystfmu.data import signals
from hystfmu.graph import Graph, Node
from papers.nested_loops import Response
from papers.statements.branches import area, crossings, least_slope
from papers.statements.printed import auxiliary
from papers.table import Row, Stated

ROW = Stated(__name__)

REVERSALS, SEED, FINE = 40, 1, 1e-3  # number, seed and step of the nested reversals on which branches are compared
# both histories end at the same input and operator value
PATHS = ((0, -0.6984, 0.1889, 0), (0, -0.8448, 0.5721, -0.2808, 0))
FROM_EXTREMUM = 0.01  # excluded distance from the extremum, at which the slope of a branch of eq. 1 is 0
ROUNDING = 1e-12


def rows(plant: Response, invertible: Response) -> list[Row]:
    """Return the table rows of the tests of eqs. 1 to 11.

    `plant` is the hysteresis. `invertible` is a hysteresis with a linear term, so that an inverse exists.
    """
    u = signals.nested_reversals(REVERSALS, SEED, FINE)
    y, wanted = plant(u), invertible(u)
    last, dominant = _run("zhao_tan", u, memory="last"), _run("zhao_tan", u)
    reconstructed, exact = (_run(f"zhao_tan_inverse{which}", wanted) for which in ("_reconstructed", ""))
    forward = [crossings(u, v, y) for v in (last, dominant)]
    backward = [crossings(wanted, v, u) for v in (reconstructed, exact)]
    about = f"{REVERSALS} nested reversals"
    x = signals.held_out()["nested reversals"]
    h = _run("zhao_tan", x)
    return [
        ROW("operator", ours=float(np.abs(last - auxiliary(u)).max()), target=ROUNDING),
        ROW("lemma_1", float(forward[0].neighbours), float(forward[1].neighbours), about=about),
        *_one_loop(plant),
        ROW("lemma_2", least_slope(u, last, FROM_EXTREMUM), least_slope(u, dominant, FROM_EXTREMUM)),
        ROW("continuity", ours=_step(plant, 0.0001) / _step(plant, 0.001)),
        ROW("crossings", float(forward[0].others), float(forward[1].others), about=about),
        ROW("at_crossings", 50 * forward[0].difference, 50 * forward[1].difference),
        _counterexample(plant),
        ROW(
            "theorem_2",
            50 * backward[0].difference,
            50 * backward[1].difference,
            others=backward[1].others,
            about=about,
        ),
        ROW(
            "exact_inverse",
            float(np.abs(_run("zhao_tan_inverse_reconstructed", h) - x).max()),
            float(np.abs(_run("zhao_tan_inverse", h) - x).max()),
        ),
    ]


def _one_loop(plant: Response) -> list[Row]:
    """Return table rows of the tests of assumption 1 and remarks 1, 4 and 5 with a sine as input.

    The tests state whether the loop of the hysteresis `plant` is closed, in which direction the loops of hysteresis and
    operators turn, and whether the operators are antisymmetric.
    """
    cycle = 400
    u = np.sin(2 * np.pi * np.arange(2 * cycle + 1) / cycle)
    y = plant(u)
    closed = slice(cycle, 2 * cycle)
    turned = area(u[closed], y[closed])
    found = {name: _run(name, u) for name in ("zhao_tan", "zhao_tan_inverse", "zhao_tan_inverse_reconstructed")}
    of = {name: area(u[closed], h[closed]) for name, h in found.items()}
    odd = [float(np.abs(h + _run(name, -u)).max()) for name, h in found.items()]
    return [
        ROW("closed", ours=float(abs(y[2 * cycle] - y[cycle]) / np.ptp(y)), target=ROUNDING),
        ROW("remark_1", ours=float(np.sign(of["zhao_tan"] * turned)), turned=turned, operator=of["zhao_tan"]),
        ROW(
            "remark_4",
            float(np.sign(of["zhao_tan_inverse_reconstructed"] * of["zhao_tan"])),
            float(np.sign(of["zhao_tan_inverse"] * of["zhao_tan"])),
            printed_area=of["zhao_tan_inverse_reconstructed"],
            area=of["zhao_tan_inverse"],
        ),
        ROW("remark_5", max(odd[0], odd[2]), max(odd[:2])),
    ]


def _counterexample(plant: Response) -> Row:
    """Return a table row with the output difference for two histories that contradict theorem 1.

    Both histories end at the same input and the same operator value, but `plant` has different outputs.
    """
    paths = [signals.ramps(list(p), FINE) for p in PATHS]
    h = [_run("zhao_tan", p)[-1] for p in paths]
    y = [plant(p)[-1] for p in paths]
    return ROW("theorem_1", ours=100 * abs(y[0] - y[1]) / 2, off=abs(h[0] - h[1]))


def _step(plant: Response, step: float) -> float:
    return float(np.abs(np.diff(plant(signals.ramps([0, 1, -0.5, 0.5], step)))).max())


def _run(block: str, u: Array, **values: str) -> Array:
    return Graph.single(Node("operator", block, {}, values)).run(u)
