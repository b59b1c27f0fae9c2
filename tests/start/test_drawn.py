"""Start with drawn devices: a held command, a light stage, the next record, creep in parallel."""

import secrets
import subprocess
import sys
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import expm
from series import series
from start.devices import records
from start.devices.device import draw
from start.devices.judge import start
from start.devices.loop import Controller, case_of, cases_of

import hystfmu as hy
from hystfmu import Graph, Input, Node, Output
from hystfmu.base.arrays import Array
from hystfmu.design.feedforward import preview
from hystfmu.design.plants import Plant, plant_set
from hystfmu.design.race import Aim
from hystfmu.identify.evidence import Evidence, Mode
from hystfmu.identify.excitation.minor_loops import examine
from hystfmu.scenario.loop.table import margin_table
from hystfmu.start.closed_loop import close
from hystfmu.start.device import FINE, device, plant_model, reach, reference_frequency
from hystfmu.start.excitation import DRAWS, _path, excitation, information
from hystfmu.start.loop import LoopPlan
from hystfmu.start.promise import HARMONICS, Misfit, misfit, promises
from hystfmu.start.references import references
from hystfmu.start.requirements import Requirements, Wanted
from hystfmu.start.run import drawn

sys.path.insert(0, str(Path(__file__).parents[1] / "identify"))
from foreign.solvers import relays

K = np.arange(1200)
U = 50 + 50 * np.exp(-0.001 * K) * np.sin(2 * np.pi * K / 150)
PLAYS = {"w0": 0.5, "r": [5.0, 12.0], "w": [0.3, 0.2]}


def ranges(*tail: hy.Node, modes: int = 0) -> dict[str, dict[str, object]]:
    nodes = [hy.Node("h", "prandtl_ishlinskii", values=PLAYS), *tail]
    model = hy.Model("device", series(*nodes), 1e-3, provenance={"span_u": [0.0, 100.0]})
    found = device(model, hy.Dataset(1e-3 * K, U, model.predict(U)))
    f_n, zeta, share = (120.0, 400.0)[:modes], (0.1, 0.05)[:modes], ((1.0,), (0.9, 0.1))[modes - 1]
    if modes:
        plant = Plant(f_n, zeta, share)
        found = replace(found, plant=plant, errors=((0.1, 0.01, 0.0), (40.0, 0.01, 0.0))[:modes])
    return drawn(found)


@pytest.mark.turn("a drawn device")
def test_one_mode_by_frequency_damping_and_gain() -> None:
    found = ranges(modes=1)
    assert set(found) == {"plant.dynamics", "plant.h_r"}
    g = found["plant.dynamics"]["second_order"]
    assert isinstance(g, dict)
    assert g["f_n"] == pytest.approx([0.99 * 120, 1.01 * 120], rel=1e-5)
    assert g["zeta"] == pytest.approx([0.07, 0.13], rel=1e-5)
    assert g["gain"] == pytest.approx([0.8, 1.2], rel=1e-5)
    assert found["plant.h_r"] == {"scale": [0.9, 1.1]}


@pytest.mark.turn("a drawn device")
def test_a_static_model_by_the_gain_of_its_output() -> None:
    assert ranges(hy.Node("out", "scaling", values={"gain": 2.0})) == {
        "plant.out_gain": {"scale": [0.8, 1.2]}, "plant.h_r": {"scale": [0.9, 1.1]}
    }  # fmt: skip
    assert set(ranges()) == {"plant.h_r"}


@pytest.mark.turn("a drawn device")
def test_two_modes_are_not_drawn() -> None:
    assert set(ranges(modes=2)) == {"plant.h_r"}


# ---- held command ----------------------------------------------------------------------------------------------------
H = 1e-3


def truth(u: Array, w: float, zeta: float, late: int) -> Array:
    """Return the output at the end of each fine step of a device whose command comes some fine steps late."""
    M = expm(np.array([[0, 1, 0], [-w * w, -2 * zeta * w, w * w], [0, 0, 0]]) * H / FINE)
    x, plays, y = np.zeros(2), [0.0, 0.0], []
    for command in np.concatenate([np.zeros(late), np.repeat(u, FINE)])[: len(u) * FINE]:
        plays = [min(max(p, command - r), command + r) for p, r in zip(plays, PLAYS["r"], strict=True)]
        v = PLAYS["w0"] * command + sum(p * k for p, k in zip(plays, PLAYS["w"], strict=True))
        x = M[:2, :2] @ x + M[:2, 2] * v
        y.append(x[0])
    return np.array(y)


@pytest.mark.turn("a drawn device")
def test_the_plant_of_the_loop_is_the_device_behind_a_converter() -> None:
    rng = np.random.default_rng()
    f, zeta, late = rng.uniform(60, 250), rng.uniform(0.02, 0.9), int(rng.integers(0, 8))
    k = np.arange(1200)
    u = 50 + 50 * np.exp(-0.001 * k) * np.sin(2 * np.pi * k / 100)
    model = hy.Model("device", hy.blocks.PrandtlIshlinskii(**PLAYS).graph, H, provenance={"span_u": [0.0, 100.0]})
    found = device(model, hy.Dataset(H * k, u, model.predict(u)))
    plant = plant_model(found, Plant((f,), (zeta,), (1.0,), late * H / FINE))
    command = rng.uniform(0, 100, 60)
    held = np.column_stack([np.repeat(command, FINE), np.zeros(60 * FINE)])
    y = plant.graph.run(np.vstack([np.zeros((1, 2)), held]), H / FINE)[1:]
    assert y == pytest.approx(truth(command, 2 * np.pi * f, zeta, late), abs=1e-9)


@pytest.mark.parametrize(("modes", "bent", "words"), [
    (0, False, "the record shows no resonance up to 100 Hz, and gives no information above"),
    (0, True, "the record shows no resonance up to 30 Hz, and determines no mode above, where its response is not"),
    (1, False, "the record gives no information about the device above 100 Hz, except for its modes at 300 Hz"),
    (1, True, "above 30 Hz the modes that the record determines do not describe its response"),
])  # fmt: skip
def test_a_note_names_modes_only_if_the_record_determines_one(modes: int, bent: bool, words: str) -> None:
    f, none = np.linspace(1, 100, 100), np.zeros(100)
    gain = np.abs(Plant((300.0,), (0.1,), (1.0,)).response(np.exp(2j * np.pi * f * 1e-6), 1e-6)) if modes else 1 + none
    gain *= np.where(bent & (f > 30), 3.0, 1.0)  # one point alone may be off by chance
    known = (Mode(300.0, 0.1, 1.0, 0.1, 0.001, 0.01),) * modes
    evidence = Evidence(H, "foh", (1.0, 100.0), f, gain, none, 1 + none, none, known, 0.0, 1e-4, 0.0, 0.0)
    graph = hy.blocks.PrandtlIshlinskii(**PLAYS).graph
    fit = {"evidence": evidence.to_dict()}
    model = hy.Model("device", graph, H, fit=fit, provenance={"span_u": [0.0, 100.0]})
    found = device(model, hy.Dataset(H * K, U, model.predict(U)))
    assert found.notes[0].startswith(words)
    assert found.band == (30 if bent else 100)


def plan(delay: int, wanted: Wanted) -> LoopPlan:
    """Return the loop of a static device with a reference, a delay for computing, and neither noise nor misfit."""
    model = hy.Model("device", hy.blocks.PrandtlIshlinskii(**PLAYS).graph, H, provenance={"span_u": [0.0, 100.0]})
    found = replace(device(model, hy.Dataset(H * K[:40], U[:40], model.predict(U[:40]))), noise=0.0)
    missed = Misfit(np.zeros(len(HARMONICS)), found.plant, H)
    asked = Requirements(delay=delay)
    return LoopPlan(found, preview(found.plant, H), missed, references(found, (wanted,)), asked, "device")


@pytest.mark.parametrize("delay", [0, 1])
def test_a_later_device_is_one_step_later_than_the_design(delay: int) -> None:
    loop = plan(delay, Wanted("sine")).scenario(None, {})
    first, late = (loop.run(case, engine="native").trace for case in ("sine", "two_steps"))
    assert first is not None
    assert late is not None
    y = [trace["plant.y"] for trace in (first, late)]
    assert np.array_equal(y[1][50 + FINE :], y[0][50:-FINE])


def test_other_devices_are_tested_by_a_reference_without_jumps() -> None:
    """The error of a jump would hide that the loop oscillates."""
    jump, sine = Wanted("step"), Wanted("sine")
    assert Requirements(reference=(jump,)).wanted == (jump, sine)
    made = references(plan(1, sine).found, (jump, Wanted("staircase"), sine))
    assert [t.name for t in made] == ["sine", "step", "staircase"]


def test_a_reference_is_read_from_a_file(tmp_path: Path) -> None:
    r = 30 + 5 * np.sin(0.02 * np.arange(400))
    (tmp_path / "r.csv").write_text("t [ms],r\n" + "\n".join(f"{2 * k},{v!r}" for k, v in enumerate(r.tolist())))
    (tried,) = plan(1, Wanted.of(str(tmp_path / "r.csv"))).tried
    assert (tried.offset, tried.amplitude) == pytest.approx((30.0, 5.0), rel=1e-3)
    assert tried.stop == pytest.approx(0.799)


@pytest.mark.parametrize("share", [1.0, 0.4])
def test_the_residual_of_small_strokes_counts_for_those_of_the_references(share: float) -> None:
    """A gain that is 1 % off: references have 0.8 times the range, whatever the strokes of the record are."""
    u = 50 + np.where(K < 50, 1.0, share) * 50 * np.sin(2 * np.pi * K / 50)
    model = hy.Model("device", Graph.single(Node("a", "scaling", {"n": 1}, {"gain": 1.0})), H)
    found = misfit(model, hy.Dataset(H * K, u, 1.01 * u), 20.0, 0.0, Plant())
    assert found.rms == pytest.approx(0.01 * 0.8 * 50 / np.sqrt(2), rel=0.03)


@pytest.mark.parametrize(("band", "mode", "left"), [(6, 3, 0.588), (10, 3, 0.169), (60, 3, 0.0), (6, 10, 0.169)])
def test_the_error_of_a_corner_counts_above_band_and_modes(band: int, mode: int, left: float) -> None:
    """RMS of a triangle with rounded turns above its harmonics, in percent of peak to peak; a sine has none there."""
    u = 50 + 50 * np.sin(2 * np.pi * K / 50)
    for shape in ("triangle", "sine"):
        loop = plan(1, Wanted(shape))
        f = loop.found.frequency
        found = replace(loop.found, plant=Plant((mode * f,), (0.1,), (1.0,)), band=band * f)
        plants = plant_set(found.plant, H, (1.0, 1.0), errors=((0.0, 0.0, 0.0),))
        aim = Aim(f * HARMONICS, np.zeros(len(HARMONICS)), np.zeros(len(HARMONICS)))
        run = SimpleNamespace(case=shape, value=lambda metric: 0.1)
        (said,) = promises(found, plants, aim, None, loop.tried, [run], hy.Dataset(H * K, u, u), found.model)
        assert said.rms_percent == pytest.approx(np.hypot(0.1, left * (shape == "triangle")), abs=3e-3)
        assert said.bound_percent == pytest.approx(2 * said.rms_percent)


# ---- light stage -----------------------------------------------------------------------------------------------------
WANTED = {"triangle": (100.0, 0.25), "sine": (10.0, 0.1)}  # frequency (Hz) and percent RMS of the stroke
PERIODS = 50  # until the error of a triangle counts


@pytest.mark.stress
def test_a_light_stage_is_scanned_by_start_alone_and_by_a_repetitive_part(tmp_path: Path) -> None:
    seed = secrets.randbelow(1 << 31)
    modes = ((700.0, 0.02, 1.0),)
    device = replace(draw(seed, 0), modes=modes, delay=1.0, rate=1e4, slow_rate=1e4, noise=1e-4)
    rng = np.random.default_rng(seed)
    t, u, y = records.record(device, "chirp", rng)
    records.write(tmp_path / "record.csv", t, u, y)
    asked = [w for shape, (f, _) in WANTED.items() for w in ("--reference", f"{shape}:{f:g}")]
    told = start(tmp_path / "record.csv", tmp_path / "made", *asked)
    assert told["approved"], (seed, told["reasons"])
    assert told["feedback"] == "full", (seed, device.text)
    cases = cases_of(tmp_path / "made" / "loop")
    for shape, (frequency, most) in WANTED.items():
        (wanted,) = (r for r in told["references"] if r["shape"] == shape)
        case = case_of(cases, wanted)
        assert case is not None
        run = Controller(case).drive(device, float(u[0]), rng)
        first = round((PERIODS if shape == "triangle" else 1) / (frequency * case.step))
        assert len(run.r) > first + 1 / (frequency * case.step)
        speed = np.abs(np.diff(run.r[first:]))
        line = speed > 0.99 * speed.max() if shape == "triangle" else speed >= 0  # without the turn-arounds
        assert line.mean() > 0.8
        e = (run.y - run.r)[first:-1][line]
        assert 100 * np.sqrt(np.mean(e**2)) / (2 * wanted["amplitude"]) <= most, (seed, shape, device.text)
    command = ["design", "repetitive", str(tmp_path / "made" / "loop"), "-o", str(tmp_path / "learns"), "--json"]
    done = subprocess.run([sys.executable, "-m", "hystfmu.cli", *command], capture_output=True, text=True)
    assert done.returncode == 0, (seed, device.text, done.stdout, done.stderr)


# ---- next record -----------------------------------------------------------------------------------------------------


def relay_device(width: float):
    """Relays with a Gaussian density, and a linear term."""
    return lambda u: (
        relays(u, lambda a, b: np.exp(-((((a - b) / 2 - 0.35) / width) ** 2) / 2 - ((a + b) / 2 / 0.3) ** 2 / 2), 40)
        + 0.3 * u
    )


def one_sine(device) -> hy.Dataset:
    u = np.sin(2 * np.pi * np.arange(1000) / 200)
    return hy.Dataset.from_signal(u, device(u), H)


@pytest.mark.stress
def test_a_device_that_began_with_one_sine_is_known_five_times_better() -> None:
    """Relays inside the loop of the sine have not moved: nothing tells their weights."""
    seed = int(np.random.SeedSequence().generate_state(1)[0])
    device = relay_device(float(np.random.default_rng(seed).uniform(0.15, 0.3)))
    data = one_sine(device)
    held_out = list(hy.signals.held_out(seed).values())

    def error(model) -> float:
        return float(np.sqrt(np.mean(np.concatenate([model.predict(v, H) - device(v) for v in held_out]) ** 2)))

    first = hy.fit(data, "krasnoselskii_pokrovskii", levels=12)
    u, h = excitation(data, reference_frequency(data), 200.0, first)
    both = hy.Dataset.joined([data, hy.Dataset.from_signal(u, device(u), h)])
    second = hy.fit(both, "krasnoselskii_pokrovskii", levels=12)
    assert error(second) < error(first) / 5, f"seed {seed}: {error(first):.3g}, then {error(second):.3g}"


@pytest.mark.parametrize("offset", [0.0, 50.0])
def test_it_stays_within_the_range_and_the_speed_of_the_record(offset: float) -> None:
    u = offset + 50 * np.sin(2 * np.pi * np.arange(1000) / 200)
    data = hy.Dataset.from_signal(u, u, H)
    found, h = excitation(data, reference_frequency(data), 200.0)
    assert h == data.h
    assert found[0] == found[-1] == u[0]
    assert u.min() <= found.min() < 0.99 * u.min() + 0.01 * u.max()
    assert 0.01 * u.min() + 0.99 * u.max() < found.max() <= u.max()
    assert np.abs(np.diff(found)).max() <= 1.01 * np.abs(np.diff(u)).max()
    assert examine(hy.Dataset.from_signal(found, found, h)).coarse == ()  # its fast sweep is small


def test_after_the_rest_follow_tones_that_are_weaker_the_faster_they_are() -> None:
    u = 50 * np.sin(2 * np.pi * np.arange(1000) / 200)
    found, _ = excitation(hy.Dataset.from_signal(u, u, H), 1 / (200 * H), 200.0)
    ends = np.flatnonzero(np.diff(found, prepend=1.0, append=1.0))  # of constant runs
    longest = np.argmax(np.diff(ends))
    tones = found[ends[longest + 1] :][: 8 * 200]  # eight loops
    assert np.abs(np.diff(found)).max() < 2 * np.abs(np.diff(tones)).max()
    power = np.abs(np.fft.rfft(tones)) ** 2
    loops = np.arange(len(power)) / 8  # periods in a loop of the record
    slow, fast, none = (power[(loops >= a) & (loops <= b)].sum() for a, b in [(0.4, 2), (4, 9), (12, 50)])
    assert 100 * none < fast < slow / 10


def test_the_draw_is_the_one_that_tells_most_of_the_model() -> None:
    data = one_sine(relay_device(0.2))
    model = hy.Model("device", hy.blocks.PrandtlIshlinskii(w0=0.5, r=[0.2, 0.7], w=[0.3, 0.2]).graph)
    found, h = excitation(data, reference_frequency(data), 200.0, model)
    speed = np.abs(np.diff(data.u)).max()
    told = [information(model, data, v, h) for v in (found, data.u, 0.1 * data.u)]
    assert told[0] > told[1] > told[2] > 0
    drawn = [_path(0.0, 1 / (reference_frequency(data) * h), speed, 0.2, seed) for seed in range(1, 1 + DRAWS)]
    assert told[0] >= 0.9 * max(information(model, data, v, h) for v in drawn)


# ---- parallel creep --------------------------------------------------------------------------------------------------
STEP, T, SLOW = 0.02, 1.5, -0.7


def with_creep(w: float) -> hy.Model:
    """Return plays with a first-order lag of the input beside them, identified on -3..3 V, say."""
    nodes = [
        Node("hysteresis", "prandtl_ishlinskii", {}, {"w0": 1.0, "r": [0.3, 0.9], "w": [0.3, 0.2]}),
        Node("creep", "creep", {}, {"w0": 0.0, "w": [w], "T": [T], "start": 1.0}),
        Node("readout", "sum", {"n": 2}, {"k": [1.0, 1.0]}),
    ]
    wires = [("hysteresis.y", "readout.u[1]"), ("creep.y", "readout.u[2]")]
    graph = Graph(nodes, wires, [Input("u", ("hysteresis.u", "creep.u"))], [Output("y", "readout.y")])
    return hy.Model("device", graph, provenance={"span_u": [-3.0, 3.0], "h": STEP}, step=STEP)


def test_what_creep_takes_back_is_no_stroke() -> None:
    """Plays at the end of a ramp to +-3: 3 + 0.3 (3 - 0.3) + 0.2 (3 - 0.9) = 4.23; held, the lag adds w 3."""
    low, high, falling = reach(with_creep(SLOW), round(20 * T / STEP))
    assert not falling
    assert [low, high] == pytest.approx([-4.23 - 3 * SLOW, 4.23 + 3 * SLOW], rel=1e-6)
    assert reach(with_creep(-2.0), round(20 * T / STEP))[2]
    high = reach(with_creep(0.5), round(20 * T / STEP))[1]
    assert high < 4.23 + 1.5, "creep that adds has not come yet in a sweep"


def test_an_inverse_with_the_creep_in_it_leaves_no_dynamics(tmp_path: Path) -> None:
    """The loop is PI and delay then: the peak of its sensitivity is a closed form."""
    model = with_creep(float(np.random.default_rng().uniform(-0.8, 0.8)))
    Kp, Ki = 0.1, 10.0
    loop = hy.Scenario("creeping", step=STEP, stop=4.0)
    loop.add("plant", model)
    loop.add("reference", hy.blocks.Reference(amplitude=1.0, frequency=0.5))
    loop.add("pid", hy.blocks.Pid(Kp=Kp, Ki=Ki))
    loop.add("inverse", model.inverse("implicit"))
    loop.add("delay", hy.blocks.Delay(n=1))
    for ends in (
        ("reference.r", "pid.y_d"),
        ("reference.r", "pid.u_ff"),
        ("plant.y", "pid.y"),
        ("pid.u", "inverse.u"),
        ("inverse.y", "delay.u"),
        ("delay.y", "plant.u"),
    ):
        loop.connect(*ends)
    loop.metric("tracking", "rms", "plant.y", "reference.r")
    table = margin_table([loop.save(tmp_path / "loop")])
    assert not table.refused
    z = np.exp(1j * np.geomspace(1e-4, 1, 20000) * np.pi)
    L = (Kp + Ki * STEP * z / (z - 1)) / z**2  # the hold, and a step of delay
    assert table.rows[0].margins["Ms_db"] == pytest.approx(float(-20 * np.log10(np.abs(1 + L).min())), abs=0.02)


@pytest.mark.stress
def test_a_device_that_contracts_has_a_loop(tmp_path: Path) -> None:
    """The gain that stands for the inverse in one case falls too."""
    u = 3 * np.sin(np.arange(1200) / 30) * np.linspace(1, 0.2, 1200)
    graph = with_creep(0.0).graph.replace(Node("readout", "sum", {"n": 2}, {"k": [-1.0, 0.0], "offset": 3.0}))
    model = hy.Model("device", graph, provenance={"span_u": [-3.0, 3.0]}, step=STEP)
    data = hy.Dataset(STEP * np.arange(1200), u, model.predict(u))
    quiet = str, lambda step: nullcontext(lambda done: None)
    made = close(model, data, tmp_path / "loop", "device", Requirements(), *quiet)
    assert made.approved
    errors = {r.case: r.verdicts[0].value for r in made.results}
    assert errors["sine"] < errors["neither"] < 50
