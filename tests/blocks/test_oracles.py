"""Every block of tests/oracles against the C core: words, sizes, default and random parameters."""

from typing import Any

import numpy as np
import pytest
from excitation import perturbed, rows, run, some
from loop_blocks import BLOCKS, parameters
from numpy.typing import NDArray

from hystfmu import InputError, Node
from hystfmu.core.library import BlockType, block_types

Array = NDArray[np.float64]
LAGS = [(1, 0, 0), (3, 2, 0), (2, 2, 2), (1, 0, 4)]
# sizes and values beside those of the contract tests; other parameters are random
MORE: dict[str, list[dict[str, Any]]] = {
    "mlp": [{"n_in": 2, "n_hidden": 12, "n_out": 1, "activation": "relu"},
        {"n_in": 5, "n_hidden": 40, "n_out": 3, "activation": "tanh"}],
    "scaling": [{"n": 3, "lo": [-0.5, -1e300, 0.1], "hi": [0.5, 0.0, 0.1]}],
    "sum": [{"n": 3}],
    "product": [{"n": 2, "m": 2, "least": 0.1}],
    "dead_zones": [{"n": 5}],
    "play_bank": [{"n": 9, "r": np.linspace(0, 1, 9)}],
    "backlash_sum": [{"n": 9, "r": np.linspace(0, 1, 9)}],
    "creep": [{"n": 3, "T": [0.005, 0.4, 8.0], "start": start} for start in ("rest", "steady")],
    "modes": [{"n": 2, "f_n": [0.3, 2.0], "zeta": [0.02, 0.01], "k": [0.9, 0.1]}],
    "delay": [{"n": n, "y0": -3.0} for n in (2, 7, 100)],
    "quantiser": [{"q": 0.3, "offset": 0.15}, {"q": 2.6 / 2**16}],
    "polynomial_narx": [
        {"n_u": n_u, "n_f": n_f, "n_y": n_y, "q": q, "n_k": n_k, "y0": 0.3}
        for n_u, n_f, n_y in LAGS
        for q in (1, 2, 3)
        for n_k in (0, 1)
    ],
    "pid": [{"Kp": 1.2, "Ki": 10700.0, "Kd": 6e-4, "tau": tau, "u_min": -1e9, "u_max": 1e9} for tau in (0.0, 2e-3)],
    "sliding_mode": [
        {"lam": 1300.0, "eta": 6.5e-4, "rho": 1.05e-4, "epsilon": 7.0, "k_i": 1.56e7, "tau": tau,
         "u_min": -1e9, "u_max": 1e9}
        for tau in (0.0, 2e-3)
    ],
    "reference": [{"shape": "triangle", "turn": 0.7, "frequency": 0.7, "phase": 2.0}],
    "adaptive_inverse": [
        {"delay": delay, "w0": 0.3, "r": np.linspace(0.05, 0.5, 10), "w": [0.1] * 10, "sd": [0.06] + [0.02] * 10,
         "f_n": 5.0, "zeta": 0.7, "sigma": 0.003, "change": 0.02, "w0_min": 0.15, "f_h": f_h}
        for delay, f_h in ((0, 0.0), (3, 0.2))
    ],
}  # fmt: skip
# a Runge-Kutta rule of the oracle, trials of a root; else rounding
BOUNDS = {"bouc_wen": 1e-6, "jiles_atherton": 1e-5, "bouc_wen_oscillator": 1e-9, "adaptive_inverse": 1e-9}
BOUNDS |= {"modified_bouc_wen": 1e-4}
BOUNDS |= {"disturbance_observer": 1e-7, "reference": 1e-11, "disturbance": 1e-11, "lead_lag": 1e-11}
ROUNDING = 1e-13
STEPS = (0.04973, 1.03e-4, 2.97113)  # s; kinks of references lie between the rows


def by_oracle(n: Node, u: Array, h: float) -> Array:
    """Rows of outputs of a block, by its definition in numpy."""
    p, state, found = parameters(n), None, []
    for k, row in enumerate(u):
        given, at = {}, 0
        for v in n.block.of("input"):
            size = n.sizes[v.name]
            given[v.name] = float(row[at]) if v.size == "1" else row[at : at + size]
            at += size
        out, state = BLOCKS[n.type](p, state, given, k * h, h if k else 0.0)
        found.append(np.concatenate([np.ravel(out[v.name]) for v in n.block.of("output")]))
    return np.array(found)


def drawn(block: BlockType, values: dict[str, Any], rng: np.random.Generator) -> Node:
    """A node of these sizes and values, its arrays of real numbers without limits random."""
    dims = {d.name: values[d.name] for d in block.dims if d.name in values}
    given = {k: v for k, v in values.items() if k not in dims}
    sizes = Node("b", block.name, dims).sizes
    for v in block.parameters:
        if v.name not in given and v.size != "1" and v.type == "real" and v.lo == -np.inf:
            given[v.name] = rng.normal(size=sizes[v.name]) / np.sqrt(sizes[v.name])
    return Node("b", block.name, dims, given)


@pytest.mark.some(10)
@pytest.mark.parametrize("name", [n for n in BLOCKS if n != "recursive_least_squares"])  # see test_adaptive_inverse.py
def test_the_core_computes_what_the_oracle_defines(name: str) -> None:
    block, rng = block_types()[name], np.random.default_rng(1)
    steps = (block.rule_step, *STEPS[1:]) if block.rule_step else STEPS
    nodes = [*some(block), *(drawn(block, values, rng) for values in MORE.get(name, ()))]
    real, compared = {v.name for v in block.parameters if v.type == "real"}, 0
    for n, some_steps in [*((n, steps) for n in nodes), *((perturbed(n, real), steps[:1]) for n in some(block))]:
        for h in some_steps:
            u = rows(block, dict(n.dims))
            try:
                want = by_oracle(n, u, h)
                got = run(n, u, h)
            except (NotImplementedError, ZeroDivisionError, InputError):
                continue  # a word without an oracle, a layer without a width, a step that the block refuses
            if np.isfinite(want).all() and np.abs(want).max() < 1e100:
                compared += 1
                size = max(np.abs(want).max(), np.abs(u).max(initial=0.0))
                assert np.abs(got - want).max() <= BOUNDS.get(name, ROUNDING) * size, (n.values, h)
    assert compared > 2
