"""The end of a step by a clock: without its rounding where it is a step of the model, as asked for otherwise."""

import math

import numpy as np
import pytest
from test_continuous import executor, put

from hystfmu import Graph, Node
from hystfmu.core.executor import Executor
from hystfmu.graph import Input, Output


def model(step: float) -> Executor:
    return Executor(Graph.single(Node("s", "scaling")).with_step(step).to_bytes())


@pytest.mark.parametrize("step", [0.1, 1e-4, 1 / 3])
@pytest.mark.parametrize("start", [0.0, 1.0, -7.3, 4096.0])
def test_a_clock_that_adds_its_steps_is_put_right(step: float, start: float) -> None:
    """Any sum of k steps ends where a master that counts ends: at start + (k - 1) step + step."""
    e, t, wrong = model(step), start, 0
    for k in range(1, 3000):
        end = start + (k - 1) * step + step
        assert e.end_of_step(start, t, step) == end
        t += step
        wrong += t != end
    assert wrong > 100, "the sum itself is rounded"


@pytest.mark.parametrize("start", [0.0, 2.0**10])
def test_what_is_farther_off_than_rounding_stays(start: float) -> None:
    """k additions round by half a unit in the last place each: 1.2e-16 (k + 3) of both times together."""
    e, step = model(0.25), 0.25
    for k in (1, 8, 1000):
        end = start + k * step
        room = 1.2e-16 * (k + 3) * (end + start)
        unit = math.ulp(end)
        for off in (room - 2 * unit, -(room - 2 * unit)):
            assert e.end_of_step(start, end - step + off, step) == end
        for off in (room + 2 * unit, -(room + 2 * unit)):
            asked = end - step + off
            assert e.end_of_step(start, asked, step) == asked + step != end


def test_a_step_that_is_none_of_the_model_stays() -> None:
    e = model(0.25)
    for t, h in [(0.1, 0.25), (0.0, 0.2), (0.0, 0.26), (0.05, 0.2), (-0.25, 0.25), (-1.0, 0.5)]:
        assert e.end_of_step(0.0, t, h) == t + h
    assert model(0.0).end_of_step(0.0, 0.3, 0.25) == 0.55
    far = 2.0**60
    assert e.end_of_step(0.0, far, 0.25) == far + 0.25


def test_the_model_of_an_inverse_need_not_stand_right_behind_it() -> None:
    """A block between an implicit inverse and its model keeps its own tangent and does not end the search for it."""
    nodes = [
        Node("inv", "implicit_inverse", {}, {"lo": -5.0, "hi": 5.0}),
        Node("other", "scaling", {"n": 1}, {"gain": 7.0}),
        Node("model", "scaling", {"n": 1}, {"gain": 4.0}),
    ]
    wires = [("inv.u", "model.u"), ("model.y", "inv.h"), ("inv.u", "other.u")]
    inputs = [Input("y", ("inv.y",))]
    graph = Graph(nodes, wires, inputs, [Output("u", "inv.u"), Output("v", "other.y")], sort=False)
    assert graph.run(np.array([1.0, -2.0])).tolist() == [[0.25, 1.75], [-0.5, -3.5]]
    c = executor(graph)
    put(c, [1.0])
    c.start(0.0)
    assert c.tangent([1.0], [], 2)[0] == pytest.approx([0.25, 1.75])
    assert c.tangent([-2.0], [], 2)[0] == pytest.approx([-0.5, -3.5])


@pytest.mark.parametrize("falls_at", [0.5, 1.0])
def test_a_branch_that_falls_only_at_its_end_is_refused(falls_at: float) -> None:
    """g(d) = (1 - e^-d)(d + a d^3): with a slope of 0 at `falls_at` d_max it falls beyond; at d_max it just holds."""
    d_max = 2.0
    d = falls_at * d_max

    def slope(a2: float, d: float) -> float:
        return float(np.exp(-d) * (d + a2 * d**3) - np.expm1(-d) * (1 + 3 * a2 * d**2))

    lo, hi = -1.0, 0.0
    for _ in range(200):
        middle = (lo + hi) / 2
        lo, hi = (lo, middle) if slope(middle, d) > 0 else (middle, hi)
    for block in ("constraint_factor", "constraint_factor_inverse"):
        for a2, good in [(hi * (1 - 1e-9), falls_at == 1.0), (lo * (1 + 1e-9), False)]:
            node = Node("b", block, {"m": 2}, {"a": [1.0, a2], "d_max": d_max})
            if good:
                Graph.single(node).executor()
            else:
                with pytest.raises(ValueError, match="b"):
                    Graph.single(node).executor()


def test_only_parameters_and_inputs_are_set() -> None:
    graph = Graph.single(Node("s", "scaling"))
    e, places = Executor(graph.to_bytes()), {p.name: p.reference for p in graph.ports}
    e.set(places["u"], 2.0)
    e.set(places["gain"], 3.0)
    e.start(0.0)
    assert e.get(places["y"]) == 6.0
    for reference in (places["y"], len(places), -1, 10**6):
        with pytest.raises(ValueError, match="not a parameter or input"):
            e.set(reference, 1.0)
