"""Tangent of every block against one-sided differences, at kinks too."""

from __future__ import annotations

import numpy as np
import pytest
from excitation import STEP, every_block, node, perturbed, plain, rows, some
from raw import Raw

from hystfmu.core.library import block_types
from hystfmu.graph import Node


def one_sided(raw: Raw, du: np.ndarray, dx: np.ndarray, e: float) -> np.ndarray:
    """Second-order difference of outputs and derivatives on the side of the seeds only."""
    u, x = raw.u.copy(), raw.x.copy()

    def at(s: float) -> np.ndarray:
        raw.u[:] = u + s * du
        raw.x[: raw.n_cstates] = x[: raw.n_cstates] + s * dx
        both = raw.output(), raw.deriv() if raw.c.deriv else np.zeros(0)
        raw.u[:], raw.x[:] = u, x
        return np.concatenate(both)

    return np.asarray((4 * at(e / 2) - at(e) - 3 * at(0.0)) / e)


def limited(n: Node) -> Node | None:
    """The node with limits that its signals reach, where it has none; None where there is nothing to limit."""
    wide = {v.name: n.value(v.name) for v in n.block.parameters if v.type == "real"}
    narrow = {name: np.sign(x) * 0.4 for name, x in wide.items() if x.size and (np.abs(x) > 1e290).all()}
    return node(n.block, {**n.values, **{name: plain(x) for name, x in narrow.items()}}) if narrow else None


DIMS = {  # other sizes than those of the table
    "mlp": [{"n_in": 3, "n_hidden": 4, "n_out": 2}],
    "polynomial_narx": [{"n_k": 0}, {"n_k": 0, "n_u": 2, "n_f": 2, "n_y": 1, "q": 3}],
    "preisach": [{"n": 7}],
    "transfer_function": [{"na": 3, "nb": 3}, {"na": 3, "nb": 1}],
}


@every_block
@pytest.mark.parametrize("kink", [False, True])
def test_tangent_is_the_one_sided_derivative(name: str, kink: bool) -> None:
    """At inputs that no update has seen, and at the last input itself: there a seed back is a reversal."""
    block, rng, depends = block_types()[name], np.random.default_rng(4), False
    real = [v for v in block.parameters if v.type == "real"]
    # output() by an integration rule: its derivative is that of the operator up to the error of the rule
    bound = 1e-6 if block.of("cstate") else max(1e-6, block.rule_error)
    nodes = [perturbed(n, {v.name for v in real}) for n in some(block)]
    nodes += [n for n in map(limited, nodes) if n]
    for dims in DIMS.get(name, []):
        sizes = Node("b", name, dims).sizes
        nodes.append(
            Node("b", name, dims, {v.name: 0.1 * rng.normal(size=sizes[v.name]) for v in real if v.size != "1"})
        )
    for n in nodes:
        raw = Raw(n)
        for rounds in range(12):
            u = rows(block, dict(n.dims), 16 + rounds, seed=rounds)
            raw.run(u, STEP)
            if not kink:
                raw.set_inputs(rng.uniform(-1.3, 1.3, u.shape[1]), 1.0)
            before = [a.tobytes() for a in (raw.p, raw.x, raw.u)]
            for _ in range(4):
                du, dx = rng.normal(size=raw.u.size), rng.normal(size=raw.n_cstates)
                du[raw.time] = 0.0
                dy, ddx = raw.tangent(du, dx)
                got = np.concatenate([dy, ddx])
                assert [a.tobytes() for a in (raw.p, raw.x, raw.u)] == before
                want = one_sided(raw, du, dx, block.smooth)
                finite = np.isfinite(got)
                assert (np.abs(want[~finite]) > 10).all(), "an infinite slope where there is none"
                scale = 1 + np.abs(want[finite]).max(initial=0)
                assert (np.abs(got - want)[finite] <= bound * scale).all(), (n.values, raw.u, got, want)
                depends |= bool(np.abs(want[finite]).max(initial=0) > 1e-3)
    assert depends == bool(block.raw.tangent), "a dependency without a tangent, or a tangent without one"
