"""The polynomial network by its definition: every monomial of every lag, in the order of theta, at every size."""

import itertools
import math

import numpy as np
import pytest
from raw import Raw

from hystfmu.graph import Node


def defined(z: list[float], q: int, theta: np.ndarray) -> float:
    """theta' phi: z_i, z_i z_j with i <= j, ..., at last the constant."""
    some = (c for d in range(1, q + 1) for c in itertools.combinations_with_replacement(z, d))
    return float(theta @ [*(math.prod(c) for c in some), 1.0])


@pytest.mark.parametrize("n_k", [0, 1])
@pytest.mark.parametrize(
    ("n_u", "n_f", "n_y", "q"),
    [(1, 0, 0, 1), (1, 1, 1, 3), (2, 0, 3, 2), (5, 0, 0, 2), (4, 1, 0, 2), (3, 2, 4, 2), (2, 5, 1, 2), (1, 0, 6, 1),
     (9, 0, 0, 1), (2, 2, 2, 4), (1, 3, 2, 5), (7, 1, 7, 2), (1, 0, 0, 10), (1, 1, 0, 10), (2, 0, 1, 9), (1, 0, 1, 10)],
)  # fmt: skip
def test_a_network_is_the_sum_of_its_monomials(n_u: int, n_f: int, n_y: int, q: int, n_k: int) -> None:
    rng = np.random.default_rng(q + 10 * n_u)
    n = math.comb(n_u + n_f + n_y + q, q)
    theta = rng.normal(size=n) / n
    dims = {"n_u": n_u, "n_f": n_f, "n_y": n_y, "q": q, "n_k": n_k}
    raw = Raw(Node("b", "polynomial_narx", dims, {"theta": theta, "y0": 0.5}))
    inputs = rng.uniform(-1.2, 1.2, (12, 2))
    found = raw.run(inputs, 0.1)[:, 0]
    u, f = ([c[0]] * 20 + c.tolist() for c in inputs.T)
    y = [0.5] * 20
    for k in range(12):
        at = 20 + k - n_k
        z = [u[at - i] for i in range(n_u)] + [f[at - i] for i in range(n_f)] + [y[-1 - i] for i in range(n_y)]
        y.append(defined(z, q, theta))
        assert found[k] == pytest.approx(y[-1], rel=1e-12, abs=1e-14), k
    if n_k == 0:
        z0 = [u[31 - i] for i in range(n_u)] + [f[31 - i] for i in range(n_f)] + [y[-2 - i] for i in range(n_y)]
        for seed in ((1.0, 0.0), (0.0, 1.0), (-2.0, 0.5)):
            slope = 0.0
            for place, s in ((0, seed[0]), *([(n_u, seed[1])] if n_f else [])):
                up, down = list(z0), list(z0)
                up[place], down[place] = z0[place] + 1e-6, z0[place] - 1e-6
                slope += s * (defined(up, q, theta) - defined(down, q, theta)) / 2e-6
            assert raw.tangent(np.array(seed), np.zeros(0))[0] == pytest.approx([slope], abs=1e-8)
    else:
        assert raw.tangent(np.ones(2), np.zeros(0))[0].tolist() == [0.0]
