"""Effects of every block: defaults that move, rate independence, derivatives that match updates, no idle parameter."""

from typing import Any

import numpy as np
import pytest
from excitation import BLOCKS, STEP, candidates, every_block, node, perturbed, plain, rows, run, some
from raw import Raw
from scipy.integrate import solve_ivp

from hystfmu.core.library import block_types
from hystfmu.graph import Node


@every_block
@pytest.mark.parametrize("h", [1e-9, STEP, 10.0])
def test_defaults_run_and_do_something(name: str, h: float) -> None:
    n = Node(name, name)
    u = rows(n.block, dict(n.dims))
    y = run(n, u, h)
    assert np.isfinite(y).all()
    if h == STEP:
        assert np.ptp(y, axis=0).max() > 0


@pytest.mark.parametrize("name", [n for n in BLOCKS if block_types()[n].rate_independent])
def test_rate_independence(name: str) -> None:
    block = block_types()[name]
    for n in some(block):
        u = rows(block, dict(n.dims))
        assert run(n, u, STEP).tobytes() == run(n, u, STEP / 2).tobytes()


@pytest.mark.parametrize("name", [n for n in BLOCKS if block_types()[n].of("cstate")])
def test_deriv_integrates_to_update(name: str) -> None:
    block, h = block_types()[name], block_types()[name].rule_step or STEP
    rise = 0.7 * h / STEP  # of the inputs over the step
    for n in some(block):
        ramp = n.values.get("hold", block.hold) == "foh"
        raw = Raw(n)
        u = rows(block, dict(n.dims), 24)
        raw.run(u, STEP)
        raw.prepare(h)
        begin, last = raw.x.copy(), u[-1]

        c = raw.n_cstates

        def f(t: float, x: np.ndarray, raw: Raw = raw, last: np.ndarray = last, ramp: bool = ramp) -> np.ndarray:
            raw.x[: raw.n_cstates] = x
            raw.set_inputs(last + rise * (t / h if ramp else 1.0), t)
            return raw.deriv()

        by_deriv = solve_ivp(f, (0, h), begin[:c], method="DOP853", rtol=1e-11, atol=1e-14).y[:, -1]
        raw.x[:] = begin
        raw.set_inputs(last + rise, h)
        raw.update(h)
        change = np.abs(raw.x[:c] - begin[:c])
        assert (np.abs(raw.x[:c] - by_deriv) <= 1e-6 * change + 1e-10 * np.abs(begin[:c]).max()).all()
        assert change.max() > 0


@every_block
def test_every_parameter_has_an_effect(name: str) -> None:
    block = block_types()[name]
    nodes = some(block)
    nodes += [perturbed(n, {v.name for v in block.parameters if v.type == "real"}) for n in nodes]
    u = rows(block, dict(nodes[0].dims))
    base = [run(n, u) for n in nodes]
    without: list[str] = []
    for v in block.parameters:
        if v.choices or v.type == "bool":
            choices: list[Any] = list(v.choices or (0, 1))
            pairs = [(a, b) for i, a in enumerate(choices) for b in choices[:i]]
            for a, b in pairs:
                if not any(
                    n.values[v.name] == a
                    and (other := node(block, {**n.values, v.name: b}))
                    and differ(y, run(other, u))
                    for n, y in zip(nodes, base, strict=True)
                ):
                    without.append(f"{v.name} = {a} against {b}")
        elif not any(
            (other := node(block, {**n.values, v.name: plain(value)}))
            and other.dims == n.dims
            and differ(y, run(other, u))
            for n, y in zip(nodes, base, strict=True)
            for value in candidates(v, n.value(v.name))
        ):
            without.append(v.name)
    assert without == []


def differ(a: np.ndarray, b: np.ndarray) -> bool:
    return bool(np.abs(a - b).max() > 1e-7 * np.abs(a).max())
