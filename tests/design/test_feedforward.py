"""The feed-forward with preview and the plant as one block by numbers: weights, steps ahead, poles, zeros."""

from dataclasses import replace

import numpy as np
import pytest

from hystfmu.design import feedforward
from hystfmu.design.feedforward import preview, transfer_function
from hystfmu.design.plants import Plant
from hystfmu.graph.recursion import discretised

H = 1e-4
MODE = Plant((700.0,), (0.02,), (1.0,), 1.5e-4)
TWO = Plant((1900.0, 700.0), (0.03, 0.02), (0.1, 0.9))


def mode(s: np.ndarray, f: float, zeta: float) -> np.ndarray:
    w = 2 * np.pi * f
    return np.asarray(w**2 / (s**2 + 2 * zeta * w * s + w**2))


def value(b: np.ndarray, a: np.ndarray, at: np.ndarray) -> np.ndarray:
    return np.asarray(np.polyval(b, at) / np.polyval(a, at))


@pytest.mark.parametrize("delay", [0.0, 0.9999999999e-4, 1.5e-4])
def test_without_a_known_mode_a_preview_is_the_delay(delay: float) -> None:
    for plant in (Plant(delay=delay), Plant((4600.0,), (0.1,), (1.0,), delay)):  # above 0.45 of the sampling rate
        found = preview(plant, H)
        assert (found.lead, found.taps.tolist(), found.zeros, found.error) == (1 + (delay > 0), [1.0], None, 0.0)


@pytest.mark.parametrize("plant", [MODE, TWO, replace(TWO, share=(-0.3, 1.3))])
def test_the_error_of_a_preview_is_that_up_to_half_the_first_mode(plant: Plant) -> None:
    found = preview(plant, H)
    assert found.taps.sum() == pytest.approx(1.0)
    assert len(found.taps) == 2 * (found.lead - int(plant.delay / H) - 1) + 1
    z = np.exp(2j * np.pi * np.linspace(0, 350, 150)[1:] * H)
    F = z**found.lead * (found.taps @ z ** -np.arange(len(found.taps))[:, None])
    if found.zeros is not None:
        F = F * value(*discretised(found.zeros, H).fraction(), z)
    alone = plant if found.zeros is not None or plant is MODE else Plant((700.0,), (0.02,), (1.0,))
    assert found.error == pytest.approx(np.abs(1 - F * alone.response(z, H)).max())
    assert found.error <= (2e-3 if plant is TWO else 1e-3)
    assert (found.zeros is None) == (plant is not TWO)  # zeros in the right half-plane have no filter


def test_the_weights_are_least_squares_over_all_frequencies() -> None:
    """Half of the first mode counts in full, the rest a third, and what lies far above is to be quiet."""
    found = preview(MODE, H)
    f = np.concatenate([np.linspace(0, 350, 150)[1:], np.linspace(350, 4500, 300)[1:]])
    z, n = np.exp(2j * np.pi * f * H), len(found.taps)
    weight, wanted = np.where(f <= 350, 1.0, np.where(f > 1120, 1e-4, 0.3)), np.where(f > 1120, 0.0, 1.0)
    columns = MODE.response(z, H)[:, None] * z[:, None] ** (found.lead - np.arange(n))

    def cost(taps: np.ndarray) -> float:
        return float(np.sum(np.abs(weight * (columns @ taps - wanted)) ** 2))

    least = cost(found.taps)
    for step in 1e-4 * (np.eye(n)[1:] - np.eye(n)[:1]):  # the sum stays 1
        assert cost(found.taps + step) > least
        assert cost(found.taps - step) > least
        assert cost(found.taps + step) - cost(found.taps - step) == pytest.approx(0, abs=1e-6 * cost(step))


@pytest.mark.parametrize("share", [(0.1, 0.9), (0.1, 0.7)])
def test_a_plant_as_one_block(share: tuple[float, float]) -> None:
    """A rest of the static gain becomes a mode eight times faster than the fastest."""
    node = transfer_function(replace(TWO, share=share), "g")
    s = 2j * np.pi * np.geomspace(1, 1e5, 50)
    rest = 1 - sum(share)
    want = share[0] * mode(s, 1900, 0.03) + share[1] * mode(s, 700, 0.02) + rest * mode(s, 8 * 1900, 0.7)
    assert value(node.value("b"), node.value("a"), s) == pytest.approx(want, rel=1e-9)
    assert len(node.value("a")) == (5 if rest < 1e-9 else 7)
    assert (node.name, [str(node.values[k]) for k in ("hold", "start")]) == ("g", ["zoh", "steady"])


def test_the_zeros_between_modes_and_the_modes_above_the_first_are_compensated() -> None:
    node = feedforward._zeros(TWO, [0, 1])
    assert node is not None
    s = 2j * np.pi * np.geomspace(1, 1e5, 50)
    G = 0.1 * mode(s, 1900, 0.03) + 0.9 * mode(s, 700, 0.02)
    assert value(node.value("b"), node.value("a"), s) * G == pytest.approx(mode(s, 700, 0.02), rel=1e-9)
    for share in ((-0.3, 1.3), (0.6, -0.4)):  # zeros that are not stable or hardly damped
        shares = replace(TWO, share=share)
        roots = np.roots(share[0] * np.polymul([1], denominator(700, 0.02)) + share[1] * denominator(1900, 0.03))
        kept = all(-r.real >= 1e-3 * abs(r) for r in roots)
        assert (feedforward._zeros(shares, [0, 1]) is not None) == kept


def denominator(f: float, zeta: float) -> np.ndarray:
    w = 2 * np.pi * f
    return np.array([1 / w**2, 2 * zeta / w, 1.0])
