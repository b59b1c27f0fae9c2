"""Numerical tests of lemmas, remarks and theorems of Zhao & Tan 2008: examples and counterexamples.

In the literal replica, a branch starts at the last extremum, and the inverse operator is reconstructed from remarks in
the paper. In our method, a branch starts at the last extremum that is not wiped out (dominant extremum), and the
inverse of eq. 1 is exact. The hysteresis consists of the ten backlash operators of section II.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import signals
from hystfmu.graph import Graph, Node
from papers.nested_loops import Response
from papers.row import Row
from papers.statements.branches import area, crossings, least_slope
from papers.statements.printed import auxiliary

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
        Row(
            "block zhao_tan against eq. 1 in a plain loop, largest difference",
            None,
            None,
            float(np.abs(last - auxiliary(u)).max()),
            ROUNDING,
            note="last extremum",
            place="eq. 1",
        ),
        Row(
            "lemma 1: crossings of a rising and a falling branch that share an extremum",
            0.0,
            float(forward[0].neighbours),
            float(forward[1].neighbours),
            note=f"{about}; holds",
            place="eqs. 2-4",
            sense="equal",
        ),
        *_one_loop(plant),
        Row(
            "lemma 2: least slope of a branch of the operator",
            0.0,
            least_slope(u, last, FROM_EXTREMUM),
            least_slope(u, dominant, FROM_EXTREMUM),
            note=f"slope at points more than {FROM_EXTREMUM:g} from the extremum; "
            "it is positive, so the inverse is continuous",
            place="eqs. 5-8",
            sense="least",
        ),
        Row(
            "continuity: largest output steps for input steps of 1e-4, relative to those for 1e-3",
            None,
            None,
            _step(plant, 1e-4) / _step(plant, 1e-3),
            0.11,
            note="a tenth: continuous along a branch",
            place="eqs. 9-10",
        ),
        Row(
            "branches that share no extremum: crossings inside the range",
            0.0,
            float(forward[0].others),
            float(forward[1].others),
            note=f"false on {about}: one (x, h) lies on two branches",
            place="remarks 2-3",
            sense="equal",
        ),
        Row(
            "difference of outputs at these crossings, % of span",
            0.0,
            50 * forward[0].difference,
            50 * forward[1].difference,
            note="(x, h) does not determine the output",
            place="remarks 2-3",
            sense="equal",
        ),
        _counterexample(plant),
        Row(
            "inverse: difference of inputs at the same (y, operator value), % of span",
            0.0,
            50 * backward[0].difference,
            50 * backward[1].difference,
            note=f"false for the same reason: {backward[1].others} crossings of the inverse operator on {about}",
            place="theorem 2",
            sense="equal",
        ),
        Row(
            "exact inverse operator after the operator, max",
            None,
            float(np.abs(_run("zhao_tan_inverse_reconstructed", h) - x).max()),
            float(np.abs(_run("zhao_tan_inverse", h) - x).max()),
            2e-14,
            note="eq. 11 is not legible in the text; literal: reconstructed from its remarks; ours: inverse of eq. 1",
            place="eq. 11",
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
        Row(
            "change of the output after a cycle between two extrema, of span",
            None,
            None,
            float(abs(y[2 * cycle] - y[cycle]) / np.ptp(y)),
            ROUNDING,
            note="the ten backlashes form closed loops",
            place="assumption 1",
        ),
        Row(
            "sense of rotation of the operator relative to the hysteresis, 1: the same",
            1.0,
            None,
            float(np.sign(of["zhao_tan"] * turned)),
            note=f"loop area over its box: hysteresis {turned:.3g}, operator {of['zhao_tan']:.3g}",
            place="remark 1",
            sense="equal",
        ),
        Row(
            "sense of rotation of the inverse operator relative to the operator, -1: opposite",
            -1.0,
            float(np.sign(of["zhao_tan_inverse_reconstructed"] * of["zhao_tan"])),
            float(np.sign(of["zhao_tan_inverse"] * of["zhao_tan"])),
            note=f"loop area over its box: {of['zhao_tan_inverse_reconstructed']:.3g}, {of['zhao_tan_inverse']:.3g}",
            place="remark 4",
            sense="equal",
        ),
        Row(
            "operator of -x plus that of x, max: branches are antisymmetric",
            0.0,
            max(odd[0], odd[2]),
            max(odd[:2]),
            note="holds",
            place="remark 5",
            sense="equal",
        ),
    ]


def _counterexample(plant: Response) -> Row:
    """Return a table row with the output difference for two histories that contradict theorem 1.

    Both histories end at the same input and the same operator value, but `plant` has different outputs.
    """
    paths = [signals.ramps(list(p), FINE) for p in PATHS]
    h = [_run("zhao_tan", p)[-1] for p in paths]
    y = [plant(p)[-1] for p in paths]
    return Row(
        "difference of outputs at the same (x, h), % of span",
        0.0,
        None,
        100 * abs(y[0] - y[1]) / 2,
        note=f"the theorem is false: two histories with the same (x, h); h differs by {abs(h[0] - h[1]):.0e}",
        place="theorem 1",
        sense="equal",
    )


def _step(plant: Response, step: float) -> float:
    return float(np.abs(np.diff(plant(signals.ramps([0, 1, -0.5, 0.5], step)))).max())


def _run(block: str, u: Array, **values: str) -> Array:
    return Graph.single(Node("operator", block, {}, values)).run(u)
