"""Design tools against closed forms: describing function of the play, margins, transfer functions, tangents."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hystfmu.base.errors import InputError
from hystfmu.design import describing_function, gains, linearise, loop, margins, to_control
from hystfmu.graph import Graph, Node
from hystfmu.model import Model

pytest.importorskip("control")
H = 1e-4
OMEGA = 2 * np.pi * 500
G0 = Node("g0", "transfer_function", {}, {"b": [OMEGA**2], "a": [1.0, 1.4 * OMEGA, OMEGA**2]})


def play(A: np.ndarray, r: float) -> np.ndarray:
    """Describing function of backlash of half width r (Gelb & Vander Velde 1968, appendix B): 0 for A <= r."""
    x = np.clip(1 - 2 * r / A, -1, 1)
    real = 0.5 + (np.arcsin(x) + x * np.sqrt(1 - x * x)) / np.pi
    return np.where(r < A, real - 1j * (1 - x * x) / np.pi, 0)


def test_play_has_its_closed_form() -> None:
    A = np.array([0.2, 0.35, 0.6, 1.0, 5.0])
    one = describing_function(Node("b", "play_bank", {"n": 1}, {"r": [0.3]}), A)
    assert np.abs(one.N - play(A, 0.3)).max() < 2e-6
    assert one.N[0] == 0
    r, w = np.linspace(0.1, 1, 10) / 2, np.linspace(0.2, 0.05, 10)
    many = describing_function(Node("b", "prandtl_ishlinskii", {}, {"w0": 0.3, "r": r, "w": w}), A)
    expected = 0.3 + sum(w_i * play(A, r_i) for r_i, w_i in zip(r, w, strict=True))
    assert np.abs(many.N - expected).max() < 2e-6
    assert (many.phase < 0).all()
    assert (many.distortion < 0.3).all()


def test_relay_and_dynamics() -> None:
    """Saturation far beyond its range is a relay: 4 M / (pi A), harmonics 1/(2k+1); a lag is its transfer function."""
    relay = describing_function(
        Node("b", "scaling", {"n": 1}, {"gain": [1e6], "lo": [-1e-6], "hi": [1e-6]}), [2.0], samples=2**14
    )
    assert relay.N[0] == pytest.approx(4 / (np.pi * 2), rel=1e-4)
    assert relay.distortion[0] == pytest.approx(np.sqrt(np.pi**2 / 8 - 1), rel=1e-3)  # odd harmonics 1/(2k+1)
    lag = Node("b", "transfer_function", {}, {"b": [1.0], "a": [0.1, 1.0], "hold": "foh"})
    got = describing_function(lag, [1.0], frequency=3.0, cycles=8)
    assert got.N[0] == pytest.approx(1 / (1 + 0.1j * 2 * np.pi * 3), rel=1e-5)


def test_refusals() -> None:
    for part, amplitudes, words in (
        (Node("b", "pid"), [1.0], "one input and one output. Got 3 and 1 instead."),
        (Node("b", "play_bank", {"n": 1}), [0.0], "The amplitudes must be finite and greater than 0"),
    ):
        with pytest.raises(InputError, match=words):
            describing_function(part, amplitudes)
    with pytest.raises(InputError, match="The step 'h' of the sampled block pid must be"):
        to_control(Node("b", "pid"))
    with pytest.raises(InputError, match=r"The block must be linear, .* Got play_bank instead"):
        to_control(Node("b", "play_bank"), H)
    with pytest.raises(InputError, match="sampled blocks"):
        linearise(Graph.single(Node("b", "pid")))


CONTROLLERS = [
    Node("b", "pid", {}, {"Kp": 1.2, "Ki": 9000.0, "Kd": 6e-4, "tau": 2e-4}),
    Node("b", "pid", {}, {"Kp": 1.2}),
    Node("b", "lead_lag", {}, {"K": 0.7, "T_z": [2e-3, 1e-4], "T_p": [3e-4, 2e-2]}),
    Node("b", "sliding_mode", {}, {"lam": 1300.0, "eta": 6.5e-4, "rho": 1e-4, "epsilon": 7.0, "k_i": 1.56e7}),
    Node("b", "super_twisting", {}, {"lam": 900.0, "k_1": 1e-3, "k_2": 0.5, "mu": 0.1, "epsilon": 50.0}),
]


@pytest.mark.parametrize("node", CONTROLLERS, ids=lambda n: n.type)
def test_a_controller_is_its_transfer_function(node: Node) -> None:
    """The block itself on a small random error; python-control's response to the same."""
    import control

    e = 1e-7 * np.random.default_rng(3).normal(size=300)
    e[0] = 0  # at the initialisation a block takes no step of its integral
    u = Graph.single(node).run(np.column_stack([0 * e, -e, 0 * e]), H).reshape(len(e), -1)[:, 0]
    expected = control.forced_response(to_control(node, H), np.arange(len(e)) * H, e).outputs
    bound = 1e-9 if node.type in ("pid", "lead_lag") else 1e-3  # the switching term is linear for small s only
    assert np.abs(u - expected).max() < bound * np.abs(expected).max()


def test_plant_is_discretised_exactly_and_linearised_by_its_tangents() -> None:
    y = Graph.single(G0).run(np.ones(60), H)
    import control

    step = control.forced_response(to_control(G0, H), np.arange(60) * H, np.ones(60)).outputs
    # the block gives the end of the step, python-control its begin; row 0 is before the input came
    assert np.abs(y[1:] - step[1:]).max() < 1e-12
    plant = Model.load(Path(__file__).parents[2] / "scenarios" / "models" / "backlash_plant.model.toml")
    gain = to_control(plant).dcgain()[0]
    assert gain == pytest.approx([0.3, 0.3], rel=1e-12)  # the plays stand still at first: w0 alone, for u and d
    assert sorted(to_control(plant).poles(), key=np.imag) == pytest.approx(
        sorted(np.roots([1.0, 1.4 * OMEGA, OMEGA**2]), key=np.imag), rel=1e-9
    )


def test_margins_of_an_integral_loop() -> None:
    """I control, held, of a plant of gain 1 with d steps of delay: L = k h / (z - 1) / z^d.

    |L| = 1 at 2 sin(w h/2) = k h, phase -90 deg - w h/2 - d w h; gain margin for d = 0: 2 / (k h).
    """
    one = Node("b", "transfer_function", {}, {"b": [1.0], "a": [1e-9, 1.0]})  # faster than any step
    k = 2000.0
    for d in (0, 2):
        L = loop(one, Node("c", "pid", {}, {"Kp": 0.0, "Ki": k}), H, delay=d)
        m = margins(L)
        wh = 2 * np.arcsin(k * H / 2)
        phase = np.pi / 2 - wh / 2 - d * wh
        assert m.stable
        assert m.phase_deg == pytest.approx(np.degrees(phase), abs=1e-3)
        assert m.crossover_hz == pytest.approx(wh / (2 * np.pi * H), rel=1e-4)
        assert m.delay_s == pytest.approx(phase / (wh / H), rel=1e-3)
        assert m.delay_steps == pytest.approx(m.delay_s / H)
        if d == 0:
            assert m.gain_db == pytest.approx(20 * np.log10(2 / (k * H)), abs=1e-3)
        assert 0 < m.modulus < 1
        assert "phase margin" in str(m)
    assert not margins(loop(one, Node("c", "pid", {}, {"Kp": 0.0, "Ki": 2.1 / H}), H)).stable
    assert not margins(loop(one, Node("c", "pid", {}, {"Kp": 0.0, "Ki": k}), H, delay=2, gain=20.0)).stable


def test_the_delay_margin_is_where_the_loop_breaks() -> None:
    """Whole steps of delay in the loop: stable below the margin, unstable above it."""
    c = Node("c", "pid", {}, {"Kp": 1.2, "Ki": 8900.0, "Kd": 6.9e-4})
    limit = margins(loop(G0, c, H)).delay_steps
    assert margins(loop(G0, c, H, delay=int(limit))).stable
    assert not margins(loop(G0, c, H, delay=int(limit) + 1)).stable


def test_gains_carry_their_units() -> None:
    found = {g.name: g for g in gains(Node("b", "sliding_mode", {}, {"lam": 1300.0, "k_i": 1e7}))}
    assert str(found["lam"]) == "lam = 1300 1/s  (slope of the sliding line)"
    assert (found["eta"].unit, found["k_i"].unit, found["rho"].unit) == ("s", "1/s2", "1")
    assert "switching" not in found  # a word
    assert str(gains(Node("b", "lead_lag", {}, {"T_z": [1.0, 2.0], "T_p": [0.1, 0.2]}))[1]).startswith("T_z = 1, 2 s")
