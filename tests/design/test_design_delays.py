"""Delays in linear models: discrete states are exact, Pade approximants meet e^(-s T) up to their order."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.design import linearise, loop, margins, to_control
from hystfmu.design.delays import unfolded
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.estimate.dynamics import Dynamics
from hystfmu.inverse import inverse
from hystfmu.model import Model

pytest.importorskip("control")
H, OMEGA = 1e-4, 2 * np.pi * 500
G0 = Node("g0", "transfer_function", {}, {"b": [OMEGA**2], "a": [1.0, 1.4 * OMEGA, OMEGA**2]})


def chain(steps: int, gain: float = 2.5) -> Graph:
    """As the kinds g0_... : a gain, G0, a delay, an offset."""
    nodes = [
        Node("input", "scaling", {"n": 1}, {"gain": gain}),
        G0,
        Node("late", "delay", {"n": steps}, {"y0": 0.0}),
        Node("readout", "scaling", {"n": 1}, {"offset": 0.0}),
    ]
    wires = [("input.y", "g0.u"), ("g0.y", "late.u"), ("late.y", "readout.u")]
    return Graph(nodes, wires, [Input("u", ("input.u",))], [Output("y", "readout.y")], step=H)


def test_a_discrete_delay_is_what_the_core_steps():
    """The impulse response of the state space against the graph, whose input is held at the end of a step."""
    graph, n = chain(3), 60
    system = to_control(graph, H)
    u = np.zeros(n + 1)
    u[1] = 1.0
    core = graph.run(u, H)
    x, rows = np.zeros((system.nstates, 1)), []
    for value in u[1:]:
        x = np.asarray(system.A) @ x + np.asarray(system.B) * value
        rows.append(float((np.asarray(system.C) @ x)[0, 0]))
    assert system.nstates == 5
    assert core[1:] == pytest.approx(np.array(rows), abs=1e-12 * np.abs(core).max())


@pytest.mark.parametrize("steps", [1, 4])
def test_the_frequency_response_is_that_of_the_parts(steps: int):
    w = 2 * np.pi * np.array([10.0, 300.0, 2000.0])
    z = np.exp(1j * w * H)
    alone = np.array([complex(to_control(G0, H)(k)) for k in z])
    late = np.array([complex(to_control(chain(steps), H)(k)) for k in z])
    assert late == pytest.approx(2.5 * alone * z**-steps, rel=1e-9)


def test_two_delays_one_behind_the_other_and_one_at_the_input():
    nodes = [Node("a", "delay", {"n": 2}), Node("b", "delay", {"n": 1}), G0]
    graph = Graph(
        nodes,
        [("a.y", "b.u"), ("b.y", "g0.u")],
        [Input("u", ("a.u",))],
        [Output("y", "g0.y"), Output("v", "b.y")],
        step=H,
    )
    system, z = to_control(graph, H), np.exp(0.3j)
    y, v = (complex(k) for k in np.ravel(system(z)))
    assert v == pytest.approx(z**-3, rel=1e-12)
    assert y == pytest.approx(complex(to_control(G0, H)(z)) * z**-3, rel=1e-9)


def test_pade_on_request():
    s = 2j * np.pi * 200
    exact = 2.5 * complex(to_control(G0)(s)) * np.exp(-s * 3 * H)
    assert complex(to_control(chain(3), pade=3)(s)) == pytest.approx(exact, rel=1e-6)


def test_a_model_with_delay_is_linearised():
    model, s = Model("m", chain(3), H), 2j * np.pi * 200
    A, B, C, D = linearise(model, pade=3)
    assert len(A) == 2 + 3
    (value,) = np.ravel(C @ np.linalg.solve(s * np.eye(len(A)) - A, B) + D)
    assert value == pytest.approx(complex(to_control(model, pade=3)(s)), rel=1e-9)
    assert value == pytest.approx(2.5 * complex(to_control(G0)(s)) * np.exp(-s * 3 * H), rel=1e-6)


def test_margins_of_a_model_with_delay():
    """A model with two steps of delay has the margins of the same model and `delay=2`."""
    pid = Node("pid", "pid", {}, {"Kp": 0.3, "Ki": 900.0})
    with_delay = margins(loop(Model("m", chain(2), H), pid, H))
    beside = margins(loop(G0, pid, H, delay=2, gain=2.5))
    assert vars(with_delay) == pytest.approx(vars(beside), rel=1e-5)


def test_refusals():
    with pytest.raises(InputError, match=r"must be given for a delay in continuous form.*pade=ORDER"):
        to_control(chain(2))
    with pytest.raises(InputError, match=r"must be given for a delay in continuous form.*pade=ORDER"):
        linearise(Model("m", chain(2), H))
    with pytest.raises(InputError, match=r"must be that of the model, 0.0001 s.*Got 0.001"):
        to_control(chain(2), 1e-3)
    with pytest.raises(InputError, match=r"'h' must be a float in \(0, inf\)"):
        to_control(chain(2), -1.0)


def late_inverse() -> tuple[Model, Model]:
    """Plays, G0 and a delay of 3.4 steps as the kinds g0_..., and their inverse."""
    values = {"w0": 0.6, "r": [0.05, 0.2], "w": [0.3, 0.2]}
    chain = [
        Node("hysteresis", "prandtl_ishlinskii", {}, values),
        *Dynamics(500.0, 0.7, 3.4 * H).nodes(H, "zoh"),
        Node("readout", "scaling", {"n": 1}, {"gain": -5.0, "offset": 3.0}),
    ]
    wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(chain)]
    graph = Graph(chain, wires, [Input("u", ("hysteresis.u",))], [Output("y", "readout.y")])
    model = Model("g0_prandtl_ishlinskii", graph, H, "", {}, {"span_u": [-1, 1]})
    return model, inverse(model)


def test_weights_of_past_samples_become_delays() -> None:
    _, made = late_inverse()
    opened = unfolded(made.graph)
    assert "polynomial_narx" not in {n.type for n in opened.nodes}
    u = 3 + np.append(0, np.cumsum(np.random.default_rng(0).normal(size=300)))
    np.testing.assert_allclose(opened.run(u, H), made.graph.run(u, H), rtol=0, atol=1e-10)


def test_an_inverse_of_dynamics_cancels_its_model_but_for_the_lag() -> None:
    """The product of both responses is a delay: the lag of the inverse, and the step for which the model is held."""
    model, made = late_inverse()
    first, second = to_control(made, H), to_control(model, H)
    for f in (0.1, 10.0, 50.0):
        z = np.exp(2j * np.pi * f * H)
        assert abs(first(z) * second(z) * z ** (made.fit["lag_steps"] + 1) - 1) < 1e-4
    assert margins(loop(model, Node("pid", "pid", {}, {"Kp": -0.1, "Ki": -50.0, "Kd": 0.0}), H)).stable
