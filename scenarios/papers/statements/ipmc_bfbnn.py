"""Numerical tests of the IPMC paper: Preisach's sum, the auxiliary function, basis functions, and the theorem.

The theorem is tested with the Preisach operator of eq. 1 as hysteresis.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset, signals
from hystfmu.graph import Graph, Node, Value
from hystfmu.identify import fit
from hystfmu.identify.methods.polynomial_narx import basis, lagged
from papers.row import Row
from papers.statements import relay_sum
from papers.statements.branches import crossings
from papers.statements.printed import auxiliary

N, Q = 9, 2  # numbers of lags n_u = n_f and order that the paper uses
CYCLES = 20
REVERSALS, SEED, FINE = 40, 1, 1e-3  # number, seed and step of the nested reversals on which branches are compared
ROUNDING = 1e-12


def rows() -> list[Row]:
    """Return the table rows of the tests of eqs. 1 to 12, of the theorem and of the appendix."""
    cycles = np.sin(2 * np.pi * np.arange(CYCLES * 200 + 1) / 200)
    printed, kept = auxiliary(cycles, corrected=False), auxiliary(cycles)
    # from the second maximum of the input on, the output of the hysteresis is the same at each maximum
    top = slice(50, None, 200)
    u = signals.nested_reversals(REVERSALS, SEED, FINE)
    values: dict[str, Value] = {"lo": -1.0, "hi": 1.0, "E": relay_sum.everett(relay_sum.density())}
    y = Graph.single(Node("hysteresis", "preisach", {"n": relay_sum.STEPS}, values)).run(u)
    of = [
        crossings(u, Graph.single(Node("f", "zhao_tan", {}, {"memory": memory})).run(u), y)
        for memory in ("last", "dominant")
    ]
    both = [50 * c.difference / float(relay_sum.density().sum()) for c in of]
    return [
        relay_sum.block_row(),
        relay_sum.increment_row(),
        Row(
            f"f after {CYCLES} cycles of amplitude 1",
            None,
            float(printed[-1]),
            abs(float(kept[-1])),
            1.0,
            note="as printed, f increases on every branch; with the sign of u - u_ex, f is a function of the state",
            place="eq. 3",
        ),
        Row(
            "theorem: difference of outputs at the same (u, f), % of span",
            0.0,
            both[0],
            both[1],
            note=f"false: {of[1].others} crossings of f on {REVERSALS} nested reversals; literal: last extremum",
            place="eqs. 4-7",
            sense="equal",
        ),
        Row(
            "appendix, case 1: crossings of branches of f inside the range, each at two outputs",
            0.0,
            float(of[0].others),
            float(of[1].others),
            note="no function f of this structure separates all branches",
            place="fig. 6",
            sense="equal",
        ),
        Row(
            f"appendix, case 2: change of f at one extremum over {CYCLES} equal cycles",
            None,
            float(np.ptp(printed[top][1:])),
            float(np.ptp(kept[top][1:])),
            ROUNDING,
            note="as printed, f grows while the output returns; with the sign of u - u_ex, f returns, too",
            place="fig. 7",
        ),
        Row(
            "network of n lags in numpy less the block polynomial_narx, largest difference, of span",
            None,
            None,
            _free_run(),
            ROUNDING,
            place="eqs. 8-9",
        ),
        Row(
            f"number of monomials, n_u = n_f = {N}, q = {Q}",
            190.0,
            None,
            float(basis(np.zeros(2 * N), Q).shape[-1]),
            note="n_1 + 1 = (18 + 2)!/(18! 2!)",
            place="eqs. 10-12",
            sense="equal",
        ),
    ]


def _free_run() -> float:
    """Return the largest difference between a fitted network and eqs. 8 to 12 in numpy, relative to the input span."""
    u = signals.decaying_sine(4, 0.1, 100)
    data = Dataset.from_signal(u, u + 0.1 * auxiliary(u), 1e-3)
    model = fit(data, "polynomial_narx", n_u=3, n_f=3, q=Q, range=2.0)
    nodes = {n.name: n for n in model.graph.nodes}
    front, network, readout = nodes["input"], nodes["network"], nodes["readout"]
    x: Array = u * front.value("gain") + front.value("offset")
    f = Graph.single(nodes["operator"]).run(x)
    z = np.column_stack([lagged(x, 3), lagged(f, 3)])
    y = (basis(z, Q) @ network.value("theta")) * readout.value("gain") + readout.value("offset")
    return float(np.abs(y - model.predict(u)).max() / np.ptp(u))
