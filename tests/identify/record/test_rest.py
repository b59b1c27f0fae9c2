"""The memory before row 0: a device that was brought to its working point before the record began."""

import numpy as np
import plants
import pytest
from foreign.solvers import FINER, bouc_wen, fine

import hystfmu as hy
from hystfmu.data import signals
from hystfmu.identify import excitation
from hystfmu.identify.excitation.rest import remembered, rest
from papers import drawn_plants

R, W = np.linspace(10.0, 250.0, 10), np.full(10, 0.15)


def plays(u: np.ndarray, before: float) -> np.ndarray:
    """Return a sum of plays that rested at an input before the first row."""
    return plants.plays(u, R, before) @ W


def record(before: float, noise: float = 1e-4, small: int = 0) -> hy.Dataset:
    """Return random nested reversals around 500 V, 100 rows from one to the next; some small ones keep the memory."""
    rng = np.random.default_rng(int(np.random.default_rng().integers(2**31)))
    turns = np.r_[500.0, rng.uniform(440, 560, small), rng.uniform(100, 900, 23 - small), 100.0, 900.0]
    u = np.interp(np.arange(2500), np.arange(26) * 100, turns)
    y = plays(u, before)
    return hy.Dataset(1e-3 * np.arange(2500), u, y + noise * np.ptp(y) * rng.standard_normal(2500))


@pytest.mark.turn("records of a fit")
@pytest.mark.some(1)
@pytest.mark.parametrize("before", [0.0, 1000.0])
def test_a_device_that_came_from_one_side_is_followed_from_row_0(before: float) -> None:
    data = record(before)
    assert (rest(data) - data.u[0]) * (before - data.u[0]) > 0
    for key in ("prandtl_ishlinskii", "actuator"):
        assert hy.fit(data, key).fit["rms_percent"] < 0.1
    assert hy.fit(data, "prandtl_ishlinskii", u0=500.0).fit["rms_percent"] > 1.0, "the option has the last word"


@pytest.mark.stress
def test_a_bent_output_does_not_hide_where_the_memory_rested() -> None:
    """A bias inside the range, not at an end of it; the bend alone leaves more than the memory would gain."""
    rng = np.random.default_rng(int(np.random.default_rng().integers(2**31)))
    before = 500.0 + rng.choice([-1, 1]) * rng.uniform(100.0, 180.0)
    plain = record(before, small=6)  # a first swing over the bias would leave nothing of it to find
    v = (plain.y - plain.y.mean()) / np.ptp(plain.y)
    data = hy.Dataset(plain.t, plain.u, v + 0.4 * v**2)
    assert rest(data) == pytest.approx(before, abs=25.0)
    at_first = hy.fit(data, "actuator", u0=500.0).fit["rms_percent"]
    assert hy.fit(data, "actuator").fit["rms_percent"] < 0.3 * at_first


@pytest.mark.stress
@pytest.mark.parametrize("seed", [31001, pytest.param(31002, marks=pytest.mark.stress)])
def test_a_bank_of_plays_finds_its_memory_after_reversals_before_the_record(seed: int) -> None:
    """Plays behind tanh that were driven to four random inputs: without the estimate, 1.8 to 2.1 %FS."""
    rng = np.random.default_rng([seed, 7])
    inside = drawn_plants.play_sum(np.random.default_rng([seed, 2]))
    before = signals.ramps([0.0, *rng.uniform(-0.9, 0.9, 4).tolist()])
    first = float(before[-1])

    def measured(signal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        u = np.concatenate([signals.ramps([first, float(signal[0])]), signal[1:]])
        return u, np.tanh(1.5 * inside(np.concatenate([before[:-1], u])) + 0.2)[len(before) - 1 :]

    data = hy.Dataset.from_signal(*measured(signals.training(100, seed)))
    v, y = measured(signals.nested_reversals(60, seed + 1))
    quick = {"starts": 1, "iterations": 60}
    found, at_rest = (hy.fit(data, "play_bank_mlp", **quick, **option) for option in ({}, {"u0": first}))
    error, worse = (100 * float(np.sqrt(np.mean((m.predict(v) - y) ** 2))) / data.span for m in (found, at_rest))
    assert error < 0.2
    assert worse > 10 * error, "the option has the last word"


@pytest.mark.some(2)
@pytest.mark.parametrize("seed", [791833505, 1484129994, 1633532985, 1984664301, 1096862116, 1465311428])
def test_a_butterfly_that_plays_do_not_describe_stays_at_rest(seed: int) -> None:
    """Each of these was put to another input, and its model erred by 0.9 instead of 0.03 %FS on other signals."""
    u = signals.training(150, seed)
    y = drawn_plants.butterfly(np.random.default_rng(seed))(u)
    y += 1e-3 * np.ptp(y) * np.random.default_rng(seed).normal(size=len(y))
    data = hy.Dataset.from_signal(u, y, 1e-3)
    assert rest(data) == data.u[0]


def test_relays_start_saturated_only_if_the_memory_rested_at_an_end_of_the_range() -> None:
    data = record(500.0)
    low, high = data.u.min(), data.u.max()
    wanted = {low: {"start": "low"}, high: {"start": "high"}, (low + high) / 2: {}}
    assert {u0: remembered("preisach", u0, data) for u0 in wanted} == wanted


def test_a_device_at_rest_stays_at_rest() -> None:
    data = record(500.0)
    assert rest(data) == data.u[0]
    assert "u0" not in hy.fit(data, "prandtl_ishlinskii").provenance["options"]


def test_an_error_that_full_swings_leave_is_not_one_of_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    """No other input is searched: after both ends of the range, plays do not remember row 0."""
    monkeypatch.setattr(excitation.rest, "minimize_scalar", None)
    u = np.interp(np.arange(1500), np.arange(16) * 100, np.r_[500.0, 900.0, 100.0, np.tile([700.0, 300.0], 6), 500.0])
    y = plays(u, 0.0) + 20 * np.random.default_rng(3).standard_normal(1500)
    assert rest(hy.Dataset.from_signal(u, y, 1e-3)) == 500.0
    with pytest.raises(TypeError):
        rest(hy.Dataset.from_signal(u[::-1], y[::-1], 1e-3))


@pytest.mark.turn("records of a fit")
def test_an_inverse_has_a_linear_term_also_where_the_device_has_none() -> None:
    """The device has a dead zone of 20 V behind each reversal; `actuator` keeps its least slope there."""
    model = hy.fit(record(0.0), "actuator")
    w = [
        n.value("w0")[0] / (n.value("w0")[0] + n.value("w").sum()) for n in model.graph.nodes if n.name == "hysteresis"
    ]
    assert w[0] >= 0.9e-3
    assert model.inverse().fit.get("cascade_rms_percent", 0.0) < 1.0


# ---- a signal that begins elsewhere ----------------------------------------------------------------------------------
H = 1e-3


def device(u: np.ndarray, **law: float) -> np.ndarray:
    return 0.4 * u + bouc_wen(fine(u), **law)[::FINER]


def path(turns: np.ndarray) -> np.ndarray:
    return np.interp(np.arange(40 * (len(turns) - 1) + 1) / 40, np.arange(len(turns)), turns)


@pytest.mark.turn("records of a fit")
@pytest.mark.some(1)
@pytest.mark.parametrize("key", ["bouc_wen", "duhem", "g0_bouc_wen"])
def test_a_model_of_bouc_wen_or_duhem_moves_to_the_first_input(key: str) -> None:
    rng = np.random.default_rng(int(np.random.default_rng().integers(2**31)))
    law = {"beta": rng.uniform(0.8, 1.5), "gamma": rng.uniform(0.2, 0.6), "n": 1.0}
    first = rng.uniform(-1, 1)
    u = path(np.r_[first, 1.0, -1.0, rng.uniform(-1, 1, 30)])
    y = device(u, **law)
    model = hy.fit(hy.Dataset(H * np.arange(len(u)), 30 * u + 50, y), key)
    to = first - np.sign(first) * rng.uniform(0.5, 0.9)  # far enough for z to move
    other = path(np.r_[to, rng.uniform(-0.9, 0.9, 6)])
    way = np.linspace(first, to, 41)[:-1]
    wanted = device(np.r_[way, other], **law)[len(way) :]
    assert np.abs(model.predict(30 * other + 50, H) - wanted).max() <= 5e-3 * np.ptp(y)
