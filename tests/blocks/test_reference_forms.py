"""The reference by its closed forms: every shape at drawn parameters, none at its default."""

import numpy as np
import pytest
from numpy.typing import NDArray

from hystfmu.graph import blocks

Array = NDArray[np.float64]
N, H = 400, 0.01


def sine(t: Array, f: float, phase: float) -> Array:
    w = 2 * np.pi * f
    return np.array([np.sin(w * t + phase), w * np.cos(w * t + phase), -(w**2) * np.sin(w * t + phase)])


def triangle(t: Array, f: float, phase: float, turn: float) -> Array:
    """Lines through 0 at the start and the middle of a cycle; parabolas for `turn` of the time around the extrema."""
    q = (f * t + phase / (2 * np.pi)) % 1
    sign = np.where(q < 0.5, 1.0, -1.0)
    away = np.abs((q % 0.5) - 0.25)  # of a cycle, from the extremum
    side = np.where((q % 0.5) < 0.25, 1.0, -1.0)
    speed, reach = 4 / (1 - turn / 2), turn / 4
    line = np.array([speed * (0.25 - away), speed * side * f, 0 * q])
    bend = speed / reach
    parabola = np.array([1 - bend * away**2 / 2, bend * away * side * f, -bend * f**2 + 0 * q])
    return sign * np.where(away < reach, parabola, line)


@pytest.mark.parametrize("draw", range(3))
@pytest.mark.parametrize("shape", ["sine", "triangle", "decaying_sine", "multisine", "steps"])
def test_shapes_are_their_closed_forms(shape: str, draw: int) -> None:
    seed = int(np.random.default_rng().integers(2**31))
    print("draw", draw, "of seed", seed)
    rng = np.random.default_rng(seed)
    amplitude, offset, lead = rng.uniform(0.3, 3, 3) * rng.choice([-1, 1], 3)
    f, phase = rng.uniform(0.2, 3), rng.uniform(-9, 9)
    t = np.arange(N) * H
    values: dict[str, float | list[float]] = {"frequency": f, "phase": phase}
    if shape == "triangle":
        values["turn"] = turn = rng.uniform(0.1, 0.9)
    elif shape == "decaying_sine":
        values["decay"] = decay = rng.uniform(0.2, 2)
    elif shape == "multisine":
        tones = [rng.uniform(0.2, 3, 4), rng.uniform(-1, 1, 4), rng.uniform(-9, 9, 4)]
        values = dict(zip(("f", "a", "ph"), (tone.tolist() for tone in tones), strict=True))
    elif shape == "steps":
        levels, duration = rng.uniform(-1, 1, 4), rng.uniform(0.5, 0.9)
        values = {"levels": levels.tolist(), "T": duration}

    def expected(at: Array) -> Array:
        if shape == "sine":
            return sine(at, f, phase)
        if shape == "triangle":
            return triangle(at, f, phase, turn)
        if shape == "decaying_sine":
            r, dr, ddr = sine(at, f, phase)
            return np.exp(-decay * at) * np.array([r, dr - decay * r, ddr - 2 * decay * dr + decay**2 * r])
        if shape == "multisine":
            return np.sum([a * sine(at, f, ph) for f, a, ph in zip(*tones, strict=True)], axis=0)
        held = levels[np.clip(np.floor(at / duration * (1 + 1e-9)), 0, 3).astype(int)]
        return np.array([held, 0 * at, 0 * at])

    found = blocks.Reference(shape=shape, amplitude=amplitude, offset=offset, lead=lead, **values)(
        np.zeros((N, 0)), H
    ).T
    now, ahead = expected(t), expected(t + lead)
    want = [offset + amplitude * now[0], offset + amplitude * ahead[0], amplitude * ahead[1], amplitude * ahead[2]]
    for got, w in zip(found, want, strict=True):
        off = np.abs(got - w) > 1e-9 * (1 + np.abs(w).max())
        assert off.mean() <= (0.01 if shape == "triangle" else 0)  # a sample at the very end of a parabola
    assert np.abs(found[0] - want[0]).max() <= 1e-9 * (1 + np.abs(want[0]).max())
