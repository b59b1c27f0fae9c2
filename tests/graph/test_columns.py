"""The recursion over many columns against the block in the executor, against scipy, and on picked rows."""

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from hystfmu import Graph, InputError, Node
from hystfmu.base.arrays import Array
from hystfmu.graph.recursion import Recursion, discretised, parallel_lags

SEED = int(np.random.default_rng().integers(2**31))
H = 1e-3


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
    assert discretised(node, H).run(u) == pytest.approx(want, rel=1e-12, abs=1e-13 * np.abs(want).max()), SEED


@pytest.mark.parametrize("hold", ["foh", "zoh"])
def test_the_fraction_in_z_is_that_of_scipy(hold: str) -> None:
    rng = np.random.default_rng(SEED)
    w, zeta = 2 * np.pi * rng.uniform(20, 400), rng.uniform(0.05, 2)
    b, a = rng.normal(size=2), np.array([1.0, 2 * zeta * w, w * w])
    top, bottom = discretised(Node("g", "transfer_function", {}, {"b": b, "a": a, "hold": hold}), H).fraction()
    want, poles, _ = cont2discrete((b, a), H, hold)
    z = np.exp(1j * np.array([0.01, 0.3, 2.0]))
    early = z if hold == "zoh" else 1.0  # the block holds the new value, scipy the old one
    found = np.polyval(top, z) / np.polyval(bottom, z)
    assert found == pytest.approx(early * np.polyval(want[0], z) / np.polyval(poles, z), rel=1e-7), SEED


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
    with pytest.raises(InputError, match=r"g: The last coefficient of a must not be 0"):
        discretised(Node("g", "transfer_function", {}, {"b": [1.0], "a": [1.0, 0.0]}), H)
    with pytest.raises(InputError, match=r"g: the step is too long"):
        discretised(fast, H)
