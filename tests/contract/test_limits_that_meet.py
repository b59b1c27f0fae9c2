"""Pairs of parameters that may be equal, and what the block says where they have passed each other."""

import itertools
import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from excitation import default, every_block
from raw import Raw

from hystfmu import Graph, InputError, Node
from hystfmu.core.library import BlockType, block_types
from hystfmu.graph.listing import group

CLAMPED = "u_min must not be greater than u_max"
MAY_MEET = [  # the lower one, the upper one, the refusal
    ("amplifier", "u_min", "u_max", "u_min must not be greater than u_max"),
    ("adaptive_inverse", "w0_min", "w0", "w0_min must not be greater than w0"),
    ("in_range", "lo", "hi", "lo must not be greater than hi"),
    ("scaling", "lo", "hi", "lo must not be greater than hi"),
    *(
        (block, "u_min", "u_max", CLAMPED)
        for block in ("adaptive_inverse", "disturbance_observer", "lead_lag", "pid", "sliding_mode", "super_twisting")
    ),
]
MUST_DIFFER = ["preisach", "krasnoselskii_pokrovskii"]


def build(block: str, values: dict[str, Any]) -> None:
    Graph.single(Node("b", block, {}, values)).executor()


@pytest.mark.parametrize(("block", "low", "high", "said"), MAY_MEET, ids=lambda v: str(v)[:20])
def test_limits_may_meet_but_not_pass(block: str, low: str, high: str, said: str) -> None:
    for at in np.random.default_rng().uniform(0.2, 3, 3).tolist():
        build(block, {low: at, high: at})
        build(block, {low: np.nextafter(at, 0), high: at})
        with pytest.raises(InputError) as e:
            build(block, {low: np.nextafter(at, 9), high: at})
        assert said in str(e.value)


@pytest.mark.parametrize("block", MUST_DIFFER)
def test_a_range_is_not_empty(block: str) -> None:
    for at in (-0.7, 1.3):
        build(block, {"lo": at, "hi": at + 0.1})
        for hi in (at, at - 0.1):
            with pytest.raises(InputError, match="lo must be less than hi"):
                build(block, {"lo": at, "hi": hi})


TWO = {"n": 2}
TOGETHER = [  # block, sizes, values that it takes together, values that it refuses, the refusal
    ("modified_bouc_wen", {}, {"beta": 0.0, "gamma": 1e4}, {"beta": 0.0, "gamma": 0.0},
     r"beta \+ gamma must be greater than 0"),
    ("bouc_wen", {}, {"beta": 0.5, "gamma": -0.4375}, {"beta": 0.5, "gamma": -0.5}, "else z is unbounded"),
    ("bouc_wen", {}, {"z0": -1.0}, {"z0": -1.0000001}, r"\|z0\| must be at most"),
    ("duhem", {}, {"w0": -2.0, "w_max": 2.0}, {"w0": -2.0000001, "w_max": 2.0}, r"\|w0\| must be at most w_max"),
    ("jiles_atherton", {}, {"m0": 0.29}, {"m0": 0.3}, r"\|m0\| must be at most Ms"),
    ("jiles_atherton", {}, {"m0": 1.0, "u0": 100.0}, {"m0": 1.001, "u0": 100.0}, r"\|m0\| must be at most Ms"),
    ("lead_lag", {}, {"T_z": [1.0], "T_p": [1e-300]}, {"T_z": [1.1], "T_p": [1e-300]}, "T_p is too small relative to"),
    ("creep_inverse", {}, {"w0": -5e-324}, {"w0": 0.0}, "w0 must not be 0"),
    ("creep_inverse", {}, {"w0": 1.0, "w": [-0.5]}, {"w0": 1.0, "w": [-1.0]}, "the gain of the creep over a step"),
    ("adaptive_inverse", TWO, {"r": [0.5, 0.5]}, {"r": [0.5, 0.4]}, "the thresholds r must not decrease"),
    ("prandtl_ishlinskii", TWO, {"r": [0.5, 0.5]}, {"r": [0.5, 0.4]}, "the thresholds r must not decrease"),
    (
        "prandtl_ishlinskii_inverse",
        TWO,
        {"w0": 1.0, "r": [0.5, 0.5], "w": [-1.0, 0.5]},  # no input lies between equal thresholds
        {"w0": 1.0, "r": [0.5, 0.5], "w": [-0.5, -0.5]},
        "must be greater than 0 for every i",
    ),
    ("transfer_function", {}, {"a": [-1.0, 1.0]}, {"a": [0.0, 1.0]}, "the first coefficient of a must not be 0"),
    ("transfer_function", {}, {"a": [1.0, 1.0]}, {"a": [1.0, 0.0]}, "has no steady state"),
    ("transfer_function", {}, {"a": [1.0, 2.0**38]}, {"a": [1.0, 2.0**39]}, "the step is too long"),
    ("modes", {}, {"f_n": [1.591e11], "zeta": [0.0]}, {"f_n": [1.592e11], "zeta": [0.0]}, "the step is too long for"),
    ("modes", {}, {"f_n": [7.95e10], "zeta": [1.0]}, {"f_n": [7.96e10], "zeta": [1.0]}, "the step is too long for"),
]  # fmt: skip


@pytest.mark.parametrize(("block", "sizes", "taken", "refused", "said"), TOGETHER)
def test_values_that_fit_together_at_their_limit(
    block: str, sizes: dict[str, int], taken: dict[str, Any], refused: dict[str, Any], said: str
) -> None:
    """Also over a step of 1 s."""
    more = {"start": "steady"} if "steady" in said else {}

    def run(values: dict[str, Any]) -> None:
        executor = Graph.single(Node("b", block, sizes, {**values, **more})).executor()
        executor.start(0.0)
        executor.step(1.0, 1.0)

    run(taken)
    with pytest.raises(InputError, match=said):
        run(refused)


@pytest.mark.parametrize("element", [0, 1, 2])
def test_every_signal_has_its_own_limits(element: int) -> None:
    """in_range and scaling: at a limit is inside, beyond is not, each element against its own two."""
    lo, hi = np.array([-1.5, 0.2, 3.0]), np.array([-1.0, 0.2, 7.0])
    inside = Graph.single(Node("b", "in_range", {"n": 3}, {"lo": lo.tolist(), "hi": hi.tolist()}))
    values = {"gain": [1.0] * 3, "lo": lo.tolist(), "hi": hi.tolist()}
    limited = Graph.single(Node("b", "scaling", {"n": 3}, values))
    middle = (lo + hi) / 2
    for limit, beyond in ((lo, -np.inf), (hi, np.inf)):
        u = np.array([middle, middle])
        u[0, element], u[1, element] = limit[element], np.nextafter(limit[element], beyond)
        assert inside.run(u, 0.1).ravel().tolist() == [1.0, 0.0]
        assert np.array_equal(limited.run(u, 0.1).reshape(2, 3), np.clip(u, lo, hi))
        changed = hi.copy()
        changed[element] = lo[element] - 0.1
        with pytest.raises(InputError, match="lo must not be greater than hi"):
            build("in_range", {"lo": lo.tolist(), "hi": changed.tolist()})


# ---- Limits of the rows of every block: round numbers, taken themselves, and the next number beyond is refused
EXACT = (2.2250738585072014e-308, 2.0**31 - 1)  # "greater than 0"; the largest number of 32 bits

DIVISORS = {  # what is derived and divided by: 1 before it is derived
    ("amplifier", "omega"),
    ("amplifier", "most"),
    ("creep_inverse", "gain"),
    ("sliding_mode", "layer"),
    ("super_twisting", "layer"),
    ("transfer_function", "sigma"),
}


@every_block
def test_limits_are_taken_and_the_next_number_beyond_is_refused(name: str) -> None:
    block, graph = block_types()[name], default(name)
    executor = graph.executor()
    for v in (*block.parameters, *block.of("input")):
        port = graph.port(v.name)
        for limit, beyond in ((v.lo, -np.inf), (v.hi, np.inf)):
            if np.isinf(limit):
                continue
            for k in range(port.size):
                executor.set(port.reference + k, limit)
                assert executor.get(port.reference + k) == limit
                with pytest.raises(InputError, match=rf"^The '{v.name}'"):
                    executor.set(
                        port.reference + k, np.nextafter(limit, beyond) if v.type == "real" else limit + np.sign(beyond)
                    )
                assert executor.get(port.reference + k) == limit


@every_block
def test_limits_are_round_numbers(name: str) -> None:
    """The page of the blocks writes them with ten digits: one that needs more would not be what it says."""
    for v in block_types()[name].vars:
        assert v.lo <= v.start <= v.hi, v
        for limit in (v.lo, v.hi):
            assert np.isinf(limit) or limit in EXACT or float(f"{limit:.2g}") == limit, (v.name, limit)


@every_block
def test_derived_values_are_zero_before_they_are_derived(name: str) -> None:
    for v in block_types()[name].of("derived"):
        assert v.start == ((name, v.name) in DIVISORS), v


# ---- Sizes of every block: smallest, default, largest.  A model of today must open in every later release as it is
SIZES = tomllib.loads(Path(__file__).with_name("sizes.toml").read_text())


def test_sizes_are_as_they_have_been() -> None:
    found = {name: {d.name: [d.lo, d.start, d.hi] for d in b.dims} for name, b in block_types().items()}
    assert {name: found.get(name) for name in SIZES} == SIZES


# ---- Groups of parameters: what a dialog shows together follows from the rows of the table
EXPECTED = {  # by hand, from the equations
    "pid": {"Gains": "Kp Ki Kd", "Filters": "tau", "Limits": "u_min u_max"},
    "prandtl_ishlinskii": {"Weights": "w0 w", "Thresholds": "r", "Start": "u0"},
    "mlp": {"Weights": "W1 b1 W2 b2", "Network": "activation"},
    "creep": {"Weights": "w w0", "Dynamics": "T", "Start": "start"},
    "sliding_mode": {
        "Controller": "lam epsilon switching", "Gains": "eta rho k_i", "Filters": "tau", "Limits": "u_min u_max"},
    "zhao_tan": {"Memory": "memory", "Start": "x0"},
}  # fmt: skip


def found(block: BlockType) -> dict[str, str]:
    groups: dict[str, list[str]] = {}
    for v in block.parameters:
        groups.setdefault(group(block, v), []).append(v.name)
    return {k: " ".join(names) for k, names in groups.items()}


@pytest.mark.parametrize("name", EXPECTED)
def test_parameters_stand_with_their_like(name: str) -> None:
    assert found(block_types()[name]) == EXPECTED[name]


@every_block
def test_a_long_dialog_is_divided(name: str) -> None:
    """No group of more than eight, but for a signal generator, whose parameters have one subject."""
    block = block_types()[name]
    assert all(len(names.split()) <= 8 for g, names in found(block).items() if g != "Signal")
    if len(block.parameters) > 8 and block.family != "sources":
        assert len(found(block)) > 2


# ---- The polynomial network by its definition: every monomial of every lag, in the order of theta, at every size
def defined(z: list[float], q: int, theta: np.ndarray) -> float:
    """theta' phi: z_i, z_i z_j with i <= j, ..., at last the constant."""
    some = (c for d in range(1, q + 1) for c in itertools.combinations_with_replacement(z, d))
    return float(theta @ [*(math.prod(c) for c in some), 1.0])


@pytest.mark.parametrize("n_k", [0, 1])
@pytest.mark.parametrize(
    ("n_u", "n_f", "n_y", "q"),
    [(1, 0, 0, 1), (1, 1, 1, 3), (2, 0, 3, 2), (5, 0, 0, 2), (4, 1, 0, 2), (3, 2, 4, 2), (2, 5, 1, 2), (1, 0, 6, 1),
     (9, 0, 0, 1), (2, 2, 2, 4), (1, 3, 2, 5), (7, 1, 7, 2), (1, 0, 0, 10), (1, 1, 0, 10), (2, 0, 1, 9), (1, 0, 1, 10),
     (1, 0, 0, 20), (1, 0, 1, 13)],
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
