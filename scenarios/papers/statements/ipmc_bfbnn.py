"""Numerical tests of the IPMC paper: Preisach's sum, the auxiliary function, basis functions, and the theorem.

The theorem is tested with the Preisach operator of eq. 1 as hysteresis.
"""

import numpy as np

from hystfmu.base import Array
from hystfmu.data import Dataset, signals
from hystfmu.graph import Graph, Node, Value
from hystfmu.identify import fit
from hystfmu.identify.methods.polynomial_narx import basis, lagged
from papers.statements import relay_sum
from papers.statements.branches import crossings
from papers.statements.printed import auxiliary
from papers.table import Row, Stated

ROW = Stated(__name__)

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
        ROW("growth", float(printed[-1]), abs(float(kept[-1]))),
        ROW("theorem", both[0], both[1], others=of[1].others),
        ROW("case_1", float(of[0].others), float(of[1].others)),
        ROW("case_2", float(np.ptp(printed[top][1:])), float(np.ptp(kept[top][1:])), target=ROUNDING),
        ROW("network", ours=_free_run(), target=ROUNDING),
        ROW("monomials", ours=float(basis(np.zeros(2 * N), Q).shape[-1])),
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
