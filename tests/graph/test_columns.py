"""The recursion over many columns against the block in the executor, against scipy, and on picked rows."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from hystfmu import Graph, InputError, Node
from hystfmu.base.arrays import Array
from hystfmu.core.columns import Recursion, discretised, parallel_lags

SEED = int(np.random.default_rng().integers(2**31))
H = 1e-3


def filtered(node: Node) -> Recursion:
    values = {v.name: node.value(v.name) for v in node.block.parameters}
    return discretised(node.block, node.dims, values, H)


@pytest.mark.parametrize("hold", ["foh", "zoh"])
@pytest.mark.parametrize("p", [1, 2, 7, 40])
def test_each_column_is_what_the_block_steps(hold: str, p: int) -> None:
    rng = np.random.default_rng(SEED)
    w, zeta = 2 * np.pi * rng.uniform(2, 400), rng.uniform(0.05, 2)
    a = np.polymul([1.0, 2 * zeta * w, w * w], [1.0, rng.uniform(5, 500)])
    node = Node("g", "transfer_function", {}, {"b": rng.normal(size=3), "a": a, "hold": hold, "start": "steady"})
    u = rng.normal(size=(300, p)).cumsum(axis=0)
    executor = Graph.single(node).executor()
    want = np.column_stack([executor.run(c[:, None], 1, H)[:, 0] for c in u.T])
    assert filtered(node).run(u) == pytest.approx(want, rel=1e-12, abs=1e-13 * np.abs(want).max()), SEED


def test_lags_are_those_of_scipy_and_start_at_rest() -> None:
    rng = np.random.default_rng(SEED)
    shares, weights, u = rng.uniform(0.001, 0.9, 4), rng.uniform(0, 1, 4), rng.normal(size=(500, 3)) + 5
    lags: list[Array] = [lfilter([s], [1, s - 1], u - u[0], axis=0) + u[0] for s in shares]
    want = u + sum(k * q for k, q in zip(weights, lags, strict=True))
    assert parallel_lags(shares, weights).run(u) == pytest.approx(want, rel=1e-11), SEED
    assert parallel_lags(shares, weights, 0.0).run(u)[0] == pytest.approx(weights.sum() * u[0])


def test_picked_rows_are_those_of_the_whole_output() -> None:
    rng = np.random.default_rng(SEED)
    u = rng.normal(size=(200, 5))
    r = Recursion(0.3 * rng.normal(size=(3, 3)), *rng.normal(size=(4, 3)), d=0.7)
    rows = np.sort(rng.integers(0, 200, 60))  # with repetitions
    assert (r.run(u, rows) == r.run(u)[rows]).all(), SEED
    assert r.run(u, rows[:0]).shape == (0, 5)
    assert r.run(u[:, :0]).shape == (200, 0)
    assert (r.run(np.asfortranarray(u)) == r.run(u)).all()


def test_what_the_block_refuses_is_refused() -> None:
    fast = Node("g", "transfer_function", {}, {"b": [1.0], "a": [1e-30, 1.0]})
    with pytest.raises(InputError, match=r"transfer_function: the step is too long"):
        filtered(fast)
