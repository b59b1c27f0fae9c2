"""Dead band: noise estimate, and a play in the model that suppresses its reversals.

tests/fmu/importers/test_keys.py tests that an FMU has the same play.
"""

from itertools import pairwise

import numpy as np
import plants
import pytest

from hystfmu import Dataset, blocks, signals
from hystfmu.data.reversals import noise
from hystfmu.identify import errors, fit
from hystfmu.identify.features.plays import dead_band


def path(seed, reversals=40, samples=60):
    """Levels as `signals.nested_reversals`, joined by half cosines: smooth, and its reversals are known."""
    rng = np.random.default_rng(seed)
    levels = [0.0, 1.0, -1.0, 1.0, -1.0]
    for k in range(reversals):
        levels.append(rng.uniform(levels[-1], 1) if k % 2 == 0 else rng.uniform(-1, levels[-1]))
    blend = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, samples + 1) / samples)
    return np.concatenate([[0.0], *[a + (b - a) * blend for a, b in pairwise(levels)]])


def noisy(u, sigma, seed=0):
    return u + sigma * np.random.default_rng(seed).normal(size=len(u))


def reversals(u):
    moves = np.diff(u)
    return int(np.sum(np.diff(np.sign(moves[moves != 0])) != 0))


@pytest.mark.parametrize("sigma", [1e-4, 1e-3, 0.02])
@pytest.mark.parametrize(
    ("u", "limit"),
    [(path(1), 0.1), (signals.training(60, 1), 0.1), (plants.prandtl_ishlinskii(path(1)) / 8, 0.3)],
    ids=["smooth", "ramps", "ten plays"],
)
def test_the_noise_of_smooth_paths_and_of_paths_with_kinks(u, limit, sigma):
    assert abs(noise(noisy(u, sigma)) / sigma - 1) < limit


def test_quantisation_counts_as_the_noise_that_it_is():
    """A step q has the RMS error q / sqrt(12); the median of whole numbers is a coarse one."""
    q = 1e-3
    assert abs(noise(q * np.round(path(1) / q)) / (q / np.sqrt(12)) - 1) < 0.4


@pytest.mark.parametrize("samples", [12, 20, 100, 1000])
def test_a_coarsely_sampled_sine_is_no_noise(samples):
    assert noise(signals.decaying_sine(20, 0.05, samples)) == 0
    assert noise(100 + signals.two_tones(samples=4 * samples)) == 0


def test_a_held_or_random_input_has_no_dead_band():
    assert dead_band(np.repeat(np.random.default_rng(0).normal(size=50), 20)) == 0
    assert dead_band(np.random.default_rng(0).normal(size=500)) == 0
    assert dead_band(path(1)) == 0


def test_wrong_reversals_are_gone():
    u, sigma = path(3), 0.005
    v = noisy(u, sigma)
    true, band = reversals(u), dead_band(v)
    assert reversals(v) > 3 * true
    behind = plants.plays(v, np.array([band]), v[0])[:, 0]
    # loops smaller than the band are not distinguishable from noise, larger ones remain; hardly any false one is left
    assert 0.9 * true < reversals(behind) < 1.1 * true


@pytest.mark.stress
@pytest.mark.parametrize(("key", "gain"), [("bouc_wen", 3), ("duhem", 2.5)])
def test_models_without_return_point_memory(key, gain):
    """RMS on another noisy record: estimated, without, with the noise known, with the input known."""
    sigma, u, v = 0.005, path(1), path(7)
    y, wanted = plants.bouc_wen(u), plants.bouc_wen(v)

    def error(clean=False, **options):
        level = 0.0 if clean else sigma
        model = fit(Dataset.from_signal(noisy(u, level), y, 1e-3), key, **options)
        return errors(model.predict(noisy(v, level, 1)), wanted, np.ptp(y))["rms_percent"], model

    (estimated, model), (without, _), (known, _) = error(), error(dead_band=0.0), error(dead_band=2 * sigma)
    clean, exact = error(clean=True)
    assert estimated < without / gain
    assert estimated < 1.05 * known
    assert estimated < 0.8  # %FS, where the noise alone is 0.25 % of the range of u
    assert clean < 0.03
    assert "dead_band" not in [n.name for n in exact.graph.nodes]
    assert abs(model.provenance["options"]["dead_band"] / (2 * sigma) - 1) < 0.1


def test_return_point_memory_needs_none():
    """Noise moves a Zhao-Tan operator by at most a few times its size and does not accumulate."""
    u = np.tile(path(5)[:241], 20)
    sigma = 0.005
    e = blocks.ZhaoTan()(noisy(u, sigma)) - blocks.ZhaoTan()(u)
    slope = np.max(np.diff(blocks.ZhaoTan()(np.linspace(-1, 1, 1001)))) / 2e-3
    assert np.abs(e).max() < 6 * slope * sigma
    assert np.abs(e[-241:]).mean() < 1.5 * np.abs(e[241:482]).mean()
