"""Parts of a loop by numbers: references, steps, requirements, tones of the model error, the input to measure next."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import hystfmu as hy
from hystfmu.design.plants import Plant
from hystfmu.start import closed_loop, excitation, promise
from hystfmu.start.device import Device, device, moving, reference_frequency
from hystfmu.start.promise import EDGES, HARMONICS, Misfit, Promise
from hystfmu.start.references import Tried, references
from hystfmu.start.requirements import Amplifier, Requirements, Wanted

H = 1e-3
PLAYS = hy.blocks.PrandtlIshlinskii(w0=0.5, r=[5.0, 12.0], w=[0.3, 0.2]).graph


@pytest.fixture(scope="module")
def found() -> Device:
    """A static device that begins at an end of its range, 5 Hz."""
    u = 50 - 50 * np.cos(2 * np.pi * 5 * H * np.arange(1001))
    model = hy.Model("device", PLAYS, H, provenance={"span_u": [0.0, 100.0]})
    return replace(device(model, hy.Dataset(H * np.arange(1001), u, model.predict(u))), frequency=5.0)


@pytest.mark.parametrize(
    ("band", "bandwidth", "modes", "told"),
    [(100.0, 2.0, (), "full"), (100.0, 1.9, (), "slow"), (100.0, 1.9, (300.0,), "full"), (0.0, 1.9, (), "slow")],
)
def test_feedback_is_slow_without_a_mode_or_a_band(
    found: Device, band: float, bandwidth: float, modes: tuple[float, ...], told: str
) -> None:
    one = tuple(0.1 for _ in modes)
    loop = SimpleNamespace(device=replace(found, band=band, plant=Plant(modes, one, one)))
    loop.tuned = SimpleNamespace(bandwidth=bandwidth)
    assert closed_loop.ClosedLoop.feedback.fget(loop) == told


@pytest.mark.parametrize(("w0", "gain", "sector"), [
    (0.8, 1.0, (0.68, 1.64)), (0.8, 1.3, (0.68, 1.3 * 1.64)), (0.8, 0.75, (0.75 * 0.68, 1.64)),
    # the slope is w0 for small swings, and that of both plays for the swings of the record, here of 80 in its middle
    (0.25, 1.0, (0.68, 1 + (0.3 * 70 + 0.2 * 56) / 80 / 0.25)),
])  # fmt: skip
def test_the_sector_contains_what_the_record_shows_and_what_it_does_not(
    w0: float, gain: float, sector: tuple[float, float]
) -> None:
    u = 50 - 50 * np.cos(2 * np.pi * 5 * H * np.arange(1001))
    plays = hy.blocks.PrandtlIshlinskii(w0=w0, r=[5.0, 12.0], w=[0.3, 0.2]).graph
    model = hy.Model("device", plays, H, provenance={"span_u": [0.0, 100.0]})
    made = device(model, hy.Dataset(H * np.arange(1001), u, gain * model.predict(u)))
    assert made.slopes == pytest.approx(sector, rel=2e-3)


# ---- references ------------------------------------------------------------------------------------------------------
def tried(found: Device, shape: str, frequency: float = 0.0) -> Tried:
    (made,) = references(found, (Wanted(shape, frequency),))
    assert (made.name, made.shape, made.frequency) == (shape, shape, frequency or 5.0)
    return made


@pytest.mark.parametrize(("shape", "levels"), [("step", [-0.25, 0.25]), ("staircase", [-1.0, 0.0, 1.0, 0.5, -0.5])])
def test_levels_of_a_reference_with_jumps(found: Device, shape: str, levels: list[float]) -> None:
    made, amplitude, middle = tried(found, shape, 8.0), 0.4 * (found.high - found.low), (found.high + found.low) / 2
    values = made.block.node.values
    assert np.asarray(values["levels"]) == pytest.approx([found.rest, *(middle + amplitude * v for v in levels)])
    assert np.asarray(values["T"]) == pytest.approx(0.125)
    assert (made.stop, made.after, made.jumps) == (pytest.approx((len(levels) + 1) * 0.125), pytest.approx(0.25), True)
    ends = amplitude * max(levels), amplitude * min(levels)
    assert (made.amplitude, made.offset) == pytest.approx(((ends[0] - ends[1]) / 2, middle + (ends[0] + ends[1]) / 2))


@pytest.mark.parametrize(("shape", "frequency", "after", "stop"), [
    ("sine", 0.0, 0.4, 0.8), ("triangle", 0.0, 0.4, 0.8), ("nested", 0.0, 0.4, 0.8), ("sine", 10.0, 5.0, 5.2),
    ("triangle", 8.0, 6.25, 6.5), ("nested", 8.0, 0.25, 0.5),
])  # fmt: skip
def test_periods_of_a_reference(found: Device, shape: str, frequency: float, after: float, stop: float) -> None:
    made = tried(found, shape, frequency)
    assert (made.after, made.stop, made.jumps) == (pytest.approx(after), pytest.approx(stop), False)
    assert (made.amplitude, made.offset) == pytest.approx(
        (0.4 * (found.high - found.low), (found.high + found.low) / 2)
    )
    r = made.block.graph.run(np.zeros((round(stop / H), 0)), H)[:, 0]
    if shape != "nested":  # it begins at rest, or at the nearest end of its range
        assert r[0] == pytest.approx(made.offset - made.amplitude, rel=1e-3)
    strength = float(np.std(r)) / (made.amplitude / math.sqrt(2))
    assert made.strength == (pytest.approx(strength) if shape == "nested" else 1.0)
    light = replace(found, plant=Plant((100.0,), (0.02,), (1.0,)))
    rings = math.ceil(7 / (2 * math.pi * 100 * 0.02) * made.frequency - 1e-9)  # periods until the mode is gone
    assert tried(light, shape, frequency).after == pytest.approx(max(after, rings / made.frequency))


def test_names_of_references_and_one_that_is_too_fast(found: Device) -> None:
    made = references(found, [Wanted("sine", f) for f in (2.0, 50.0)] + [Wanted("step")])
    assert [t.name for t in made] == ["sine", "sine_2", "step"]
    assert [t.shape for t in references(found, ())] == ["sine", "nested", "triangle", "step"]
    with pytest.raises(hy.InputError, match=r"at least 20 steps of 0\.001 s in a period\. Got 19\.6 with sine:51\."):
        references(found, [Wanted("sine", 51.0)])


def test_powers_of_references(found: Device) -> None:
    f = np.array([5.0, 15.0, 25.0, 35.0])
    sine, triangle, nested = (tried(found, s).powers(f) for s in ("sine", "triangle", "nested"))
    half = tried(found, "sine").amplitude ** 2 / 2
    assert sine == pytest.approx([half, 0, 0, 0])
    n = np.arange(1.0, 40, 2)
    a = 8 / (np.pi * n) ** 2 * np.abs(np.sinc(n * 0.05)) / 0.95
    assert triangle == pytest.approx(half * np.array([*a[:3] ** 2, (a[3:] ** 2).sum()]))
    assert nested == pytest.approx(half * 0.25 * np.array([*n[:3] ** -4, (n[3:] ** -4).sum()]))


# ---- responses and requirements --------------------------------------------------------------------------------------
class Rows(dict[str, Any]):
    t = 0.1 * np.arange(30)


@pytest.mark.parametrize(("last", "settling"), [(1.0, 0.4), (1.1, math.inf)])
def test_overshoot_and_settling_of_the_steps_after_the_first(last: float, settling: float) -> None:
    r = np.repeat([1.0, 3.0, 1.0], 10)
    y = np.concatenate([np.zeros(10), [1, 1.5, 3.4, 3.1, 3.03, 3, 3, 3, 3, 3], [3.0, 2.0], np.full(7, 1.0), [last]])
    case = SimpleNamespace(metrics={"tracking": SimpleNamespace(signal="plant.y")}, step=0.1)
    result: Any = SimpleNamespace(trace=Rows({"reference.r": r, "plant.y": y}), system=SimpleNamespace(case=case))
    of: Any = SimpleNamespace(name="step", after=1.0)
    made = closed_loop.step_response(of, result)
    assert (made.name, made.overshoot, made.settling) == ("step", pytest.approx(20.0), pytest.approx(settling))
    of.after = 2.0
    assert closed_loop.step_response(of, result).overshoot == 0.0
    lost = closed_loop.step_response(of, SimpleNamespace(trace=None))  # type: ignore[arg-type]
    assert (lost.overshoot, lost.settling) == (math.inf, math.inf)


def test_a_line_for_each_requirement_that_is_missed() -> None:
    def promised(name: str, shape: str, rms: float | None) -> Promise:
        return Promise(name, shape, 1.0, 1.0, 0.0, 1.0, rms, rms)

    said = (promised("a", "sine", 2.0), promised("b", "nested", 2.1), promised("c", "sine", None))
    jumps = (promised("d", "step", 9.0), promised("e", "staircase", None))
    steps = tuple(closed_loop.StepResponse(*of) for of in (("s", 5.0, 0.1), ("t", 5.1, 0.11)))
    asked = Requirements(error=2.0, overshoot=5.0, settling=0.1)
    assert closed_loop._missed(said + jumps, steps, asked) == [
        "b: the required error is 2 %; the expected one is 2.1 %",
        "c: the required error is 2 %; the error on the device is not known",
        "t: the largest allowed overshoot is 5 %; got 5.1 %",
        "t: the largest allowed settling time is 0.1 s; got 0.11 s",
    ]
    assert closed_loop._missed(said + jumps, steps, Requirements()) == []


def test_the_slew_rate_of_the_amplifier() -> None:
    u = np.repeat([0.0, 9.0, 9.0, 10.0, 12.0], 5)
    trace = Rows({"inverse.y": u})
    trace.t = 2e-4 * np.arange(25)
    result = SimpleNamespace(trace=trace)
    loop: Any = SimpleNamespace(command="inverse.y", found=SimpleNamespace(h=H))
    of: Any = SimpleNamespace(name="sine", after=1e-3)  # not the way from rest
    for slew, line in ((2000.0, ""), (1999.0, "sine: needs a slew rate of 2e+03; the amplifier has 2e+03")):
        loop.asked = Requirements(amplifier=Amplifier(slew))
        assert closed_loop._Runs.too_fast(loop, of, result) == line  # type: ignore[arg-type]


# ---- promises --------------------------------------------------------------------------------------------------------
def test_tones_of_the_model_error_stand_for_their_bands() -> None:
    power = np.arange(1.0, len(HARMONICS) + 1)
    power[3] = 1e-5 * power.sum()
    missed = Misfit(power, Plant(), H)
    assert missed.rms == pytest.approx(math.sqrt(power.sum()))
    f, found = missed.lines(10.0)
    kept = [k for k in range(len(power)) if k != 3 and 10 * EDGES[k] < 450]
    assert f == pytest.approx([min(10 * HARMONICS[k], 450.0) for k in kept])
    assert found == pytest.approx(power[kept])
    mode = Misfit(power, Plant((100.0,), (0.1,), (1.0,)), H)

    def gain(at: Any) -> Any:
        return np.abs(mode.plant.response(np.exp(2j * np.pi * np.atleast_1d(at) * H), H)) ** 2

    f, found = mode.lines(10.0)
    assert found[5] == pytest.approx(power[6] * gain(10.0 * np.arange(9, 14)).mean() / gain(10 * HARMONICS[6])[0])
    values = missed.tones(10.0, 3, 0.5).node.values
    assert np.asarray(values["a"]) == pytest.approx(0.5 * np.sqrt(2 * power[kept]), rel=1e-5)
    phases = np.random.default_rng(3).uniform(-np.pi, np.pi, len(kept))
    assert np.asarray(values["ph"]) == pytest.approx(phases, rel=1e-5)
    assert np.asarray(Misfit(0 * power, Plant(), H).tones(10.0, 3).node.values["a"]).tolist() == [0.0]


@pytest.mark.parametrize(("fit", "noise", "said"), [
    ({"rms_percent": 5.0}, 0.0, ""),
    ({"rms_percent": 5.1}, 0.0, "m does not follow the record (an error of 5.1 % of the span, the noise is 0 %)"),
    ({"validation_percent": 5.1}, 2.0, ""),  # without the noise it is 4.7 %
    ({"held_out_rms_percent": 5.5, "rms_percent": 1.0}, 2.0, "m does not follow the record"),
    ({"rms_percent": 0.3, "warnings": ["a.b and c.d are at a bound"]}, 0.05, "the fit ended at a bound of"),
    ({"rms_percent": 0.3, "warnings": ["a.b and c.d are at a bound"]}, 0.06, ""),
    ({"rms_percent": 0.2, "warnings": ["a.b and c.d are at a bound"]}, 0.0, ""),
    ({"rms_percent": 3.0}, 0.0, ""),
])  # fmt: skip
def test_what_a_model_must_reproduce(fit: Any, noise: float, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(promise, "at_bounds", lambda warnings: ["a.b", "c.d"] if warnings else [])
    model: Any = SimpleNamespace(fit=fit, key="m")
    told = promise.misfitted(model, noise)
    assert told.startswith(said) if said else told == ""


@pytest.mark.parametrize(("turns", "warned", "fault", "f_n", "band", "said"), [
    (20, "", "", (100.0,), 25.0, ""),
    (19, "", "", (100.0,), 25.0, "the record does not show the memory of the hysteresis"),
    (20, "not informative", "", (100.0,), 25.0, "the record does not show the memory of the hysteresis"),
    (20, "", "poor", (), 25.0, "poor"),
    (20, "", "", (), 25.0, "the record does not show the dynamics of the device"),
    (20, "", "", (100.0,), 24.9, "the reference is faster than the record shows (24.9 Hz)"),
])  # fmt: skip
def test_why_an_error_is_not_known(turns: int, warned: str, fault: str, f_n: Any, band: float, said: str) -> None:
    u = np.concatenate(
        [np.tile([0.0, 1.0], 20)[: turns + 1], [0.5], np.tile([0.5, 0.545], 9)]
    )  # small ones do not count
    data = hy.Dataset.from_signal(u, u, H)
    model: Any = SimpleNamespace(fit={"warnings": [warned] if warned else []})
    known: Any = SimpleNamespace(plant=SimpleNamespace(f_n=f_n), band=band)
    of: Any = SimpleNamespace(frequency=5.0)
    size = len(promise.turning_points(u, promise.SMALL))
    assert size == turns, "as counted by hand"
    assert promise.unknown(known, of, data, model, fault) == said


# ---- the record ------------------------------------------------------------------------------------------------------
def test_the_frequency_of_a_record_is_that_of_its_strokes() -> None:
    u = np.concatenate([np.zeros(100), np.sin(2 * np.pi * np.arange(1000) / 200), 0.02 * np.sin(np.arange(500))])
    rows = moving(u, 0.4)
    assert (rows.start, rows.stop) == (114, 1088)
    assert moving(np.zeros(5), 0.1) == slice(0, 5)
    data = hy.Dataset.from_signal(u, u, H)
    assert reference_frequency(data) == float(f"{11 / (2 * 974 * H):.3g}")
    fast, slow = np.sin(2 * np.pi * np.arange(99) / 6), np.linspace(0, 1, 50_000)
    found = [reference_frequency(hy.Dataset.from_signal(v, v, H)) for v in (fast, slow)]
    assert found == [10.0, 0.05]  # periods of 100 and 20000 steps


# ---- the input to measure next ---------------------------------------------------------------------------------------
def test_the_sweep_of_the_next_record() -> None:
    first, last = 0.002, 0.1
    v = excitation._sweep(first, last, 1.0)
    assert len(v) == 15000
    k = np.arange(15000)
    rate = math.log(last / first) / 15000
    assert v == pytest.approx(0.01 * np.sin(2 * np.pi * first * np.expm1(rate * k) / rate), abs=1e-12)
    assert len(excitation._sweep(0.0, 0.1, 1.0)) == 15000  # from a hundredth of the last frequency
    assert len(excitation._sweep(0.1, 0.1, 1.0)) == 0
    slow = excitation._sweep(first, last, 1e-3)
    assert np.abs(np.diff(slow)).max() == pytest.approx(1e-3, rel=0.02)
    assert excitation._rows(200.0, 0.1) == pytest.approx(1.1 * 41 * 200 + 15000)


def test_nested_half_cosines_of_the_next_record() -> None:
    v = excitation._nested(1.0, 0.02, np.random.default_rng(2))
    turns = v[[k for k in range(1, len(v) - 1) if (v[k] - v[k - 1]) * (v[k + 1] - v[k]) < 0]]
    assert len(turns) == 29  # and the last of the 30 levels, on the way to 0
    assert v[-1] == 0.0
    assert (turns[:28:2] < turns[1::2]).all()
    assert np.abs(np.diff(v)).max() <= 0.02 * (1 + 1e-9)
    ends = np.concatenate([[1.0], turns, [0.0]])
    at = np.concatenate([[-1], np.flatnonzero(np.isin(v, turns)), [len(v) - 1]])
    speeds = np.pi / 2 * np.abs(np.diff(ends)) / np.diff(at)
    assert 0.2 * 0.02 * 0.8 < speeds[np.diff(at) > 20].min() < speeds.max() <= 0.02 * (1 + 1e-9)


def test_tones_of_the_next_record() -> None:
    v = excitation._tones(200.0, 0.02, np.random.default_rng(2))
    assert (len(v), v[0], v[-1]) == (1600, 0.0, 0.0)
    rng = np.random.default_rng(2)
    f, k = np.geomspace(0.0025, 0.04, 16), np.arange(1600)
    want = sum(a * np.sin(2 * np.pi * (b * k + p)) for a, b, p in zip(f**-1.3, f, rng.uniform(0, 1, 16), strict=True))
    want = want * np.clip(np.minimum(k, 1599 - k) / 160, 0, 1)
    assert v / np.abs(v).max() == pytest.approx(want / np.abs(want).max(), abs=1e-12)
    assert max(np.abs(v).max(), np.abs(np.diff(v)).max() / 0.02) == pytest.approx(1.0)
    fast = excitation._tones(30.0, 9.0, np.random.default_rng(2))
    assert np.abs(fast).max() == pytest.approx(1.0)
