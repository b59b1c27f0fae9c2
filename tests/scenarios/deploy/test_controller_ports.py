"""What an exported controller is: its ports, what is in it and what not, its step, and the loops that have none."""

from pathlib import Path

import numpy as np
import pytest
from called import Called, same_bits
from invoked import invoked

import hystfmu as hy

ROOT = Path(__file__).parents[3]
H = 1e-3


def parts(called: Called) -> set[str]:
    """Blocks inside, by their parameters."""
    return {name.rpartition("_")[0] for name, v in called.variables.items() if v.causality == "parameter"}


def made(loop: hy.Scenario, folder: Path, **how: object) -> Called:
    return Called(loop.export_controller(folder / "c.fmu", **how), folder / "called")  # type: ignore[arg-type]


CONNECTED = {
    "pid.u_ff": "reference.r_lead", "pid.y_d": "reference.r", "pid.y": "plant.y", "gain.u": "pid.u", "plant.u": "gain.y"
}  # fmt: skip


def small(
    order: tuple[str, ...] = (), ripple: int = 1, wires: dict[str, str] | None = None, **how: object
) -> hy.Scenario:
    """A lag under an integral with feed-forward; `how` goes to the units of the controller."""
    loop = hy.Scenario("small", step=H, stop=0.2, ripple=ripple)
    loop.add("plant", hy.blocks.TransferFunction(b=[1.0], a=[0.02, 1.0]), fine=ripple > 1)
    loop.add("reference", hy.blocks.Reference(frequency=7.0, lead=2 * H))
    loop.add("pid", hy.blocks.Pid(Kp=0.2, Ki=20.0), **how)  # type: ignore[arg-type]
    loop.add("gain", hy.blocks.Scaling(gain=1.5), **how)  # type: ignore[arg-type]
    for target, source in (CONNECTED | (wires or {})).items():
        loop.connect(source, target)
    loop.metric("tracking", "rms_percent", "plant.y", against="reference.r")
    return loop.order(*order) if order else loop


def test_ports_of_a_stage(tmp_path: Path) -> None:
    called = made(hy.Scenario.load(ROOT / "scenarios/stage/irc_repetitive"), tmp_path, case="scan_100", fmi=3)
    v = called.variables
    assert called.inputs == ["r", "y", "feedforward_r", "u_present"]
    assert [v[name].unit for name in ("r", "y", "u_present", "u")] == ["um", "um", "V", "V"]
    assert [name for name in v if v[name].causality == "output"] == ["u"]
    assert v["pid_Ki"].variability == "tunable"
    assert float(v["pid_Ki"].start) == 232.8
    assert {"repetitive", "pid", "error", "damping", "command", "handover"} <= parts(called)
    assert not {"plant", "reference", "noise", "sensor", "adc", "dac", "delay"} & parts(called)
    assert called.h == 1e-4
    assert not called.description.coSimulation.canHandleVariableCommunicationStepSize
    assert float(called.description.coSimulation.fixedInternalStepSize) == 1e-4


def test_what_is_read_ahead_is_stated(tmp_path: Path) -> None:
    called = made(hy.Scenario.load(ROOT / "scenarios/pid"), tmp_path)
    assert called.inputs == ["r", "y", "r_ahead", "r_dot", "r_ddot", "u_present"]
    for name in ("r_ahead", "r_dot", "r_ddot"):
        assert "0.00015 s ahead" in called.variables[name].description
    assert "ahead" not in called.variables["r"].description
    assert called.variables["r_ddot"].unit == "1/s2"
    assert "u act 1 step after the sample" in called.description.description


def test_memory_of_the_computing_time_stays_where_the_controller_reads_it(tmp_path: Path) -> None:
    """Repetitive control learns only where the last command, behind the delay, was within the limits."""
    called = made(hy.Scenario.load(ROOT / "scenarios/repetitive"), tmp_path)
    assert {"delay", "within", "limited", "lost", "handover"} <= parts(called)


def test_a_tuned_gain_is_that_of_the_scenario(tmp_path: Path) -> None:
    loop = hy.Scenario.load(ROOT / "scenarios/pid").record("reference.r", "sensor.y", "inverse.y", *AHEAD.values())
    result = loop.run("sine_10", engine="native", set={"pid.Ki": 3000.0})
    assert result.trace is not None
    called = made(loop, tmp_path)
    called.write({"pid_Ki": 3000.0})
    ends = {"r": "reference.r", "y": "sensor.y", **AHEAD}
    columns = {name: result.trace[end][::10] for name, end in ends.items()}
    same_bits(lambda: called, columns, result.trace["inverse.y"][::10])


AHEAD = {"r_ahead": "reference.r_lead", "r_dot": "reference.dr_lead", "r_ddot": "reference.ddr_lead"}


@pytest.mark.turn("good FMUs")
@pytest.mark.some(1)
@pytest.mark.parametrize(("scenario", "fmi"), [("pid", 2), ("h_infinity", 3), ("stage/ppf", 2), ("adaptive", 3)])
def test_it_is_a_good_fmu(scenario: str, fmi: int, tmp_path: Path) -> None:
    fmu = hy.Scenario.load(ROOT / "scenarios" / scenario).export_controller(tmp_path / "c.fmu", fmi)  # type: ignore[arg-type]
    assert hy.validate(fmu) == []


@pytest.mark.parametrize("ripple", [1, 5])
def test_a_controller_before_its_plant_reads_the_last_sample(ripple: int, tmp_path: Path) -> None:
    loop = small(("reference", "pid", "gain", "plant"), ripple)
    loop.record("reference.r", "reference.r_lead", "plant.y", "gain.y")
    trace = loop.run(engine="native").trace
    assert trace is not None
    called = made(loop, tmp_path)
    assert f"{H / ripple:g} s ahead" in called.variables["r"].description
    assert f"{(2 + 1 / ripple) * H:g} s ahead" in called.variables["r_ahead"].description
    y = trace["plant.y"][ripple - 1 :: ripple]
    columns = {"r": trace["reference.r"][::ripple], "r_ahead": trace["reference.r_lead"][::ripple]}
    same_bits(
        lambda: called, columns | {"y": np.concatenate([[0.0], y])[: len(columns["r"])]}, trace["gain.y"][::ripple]
    )


def test_a_slower_controller_is_called_at_its_own_rate(tmp_path: Path) -> None:
    loop = small(("plant", "reference", "pid", "gain"), 2, every=4)
    trace = loop.record("reference.r", "reference.r_lead", "plant.y", "gain.y").run(engine="native").trace
    assert trace is not None
    called = made(loop, tmp_path)
    assert called.h == 4 * H
    ends = {"r": "reference.r", "r_ahead": "reference.r_lead", "y": "plant.y"}
    same_bits(lambda: called, {k: trace[end][::8] for k, end in ends.items()}, trace["gain.y"][::8])


def test_a_filter_of_the_reference_is_in_it_and_hardware_is_not(tmp_path: Path) -> None:
    wires = {"filter.u": "reference.r", "pid.y_d": "filter.y", "sensor.u_1": "plant.y", "sensor.u_2": "noise.w"}
    wires |= {"adc.u": "sensor.y", "pid.y": "adc.y", "dac.u": "gain.y", "delay.u": "dac.y", "drive.u": "delay.y"}
    loop = small(wires=wires | {"plant.u": "drive.y"}).add("filter", hy.blocks.TransferFunction(b=[1.0], a=[0.01, 1.0]))
    loop.add("noise", hy.blocks.Noise(sigma=0.01)).add("sensor", hy.blocks.Sum()).add(
        "adc", hy.blocks.Quantiser(q=0.01)
    )
    loop.add("dac", hy.blocks.Quantiser(q=0.01)).add("delay", hy.blocks.Delay(n=2)).add("drive", hy.blocks.Amplifier())
    loop.order("plant", "reference", "noise", "sensor", "adc", "filter", "pid", "gain", "dac", "delay", "drive")
    called = made(loop, tmp_path)
    assert {name.partition("_")[0] for name in parts(called)} == {"filter", "pid", "gain", "handover"}
    assert "adc.y" in called.variables["y"].description
    assert "2 steps" in called.description.description
    trace = loop.record("reference.r", "reference.r_lead", "adc.y", "gain.y").run(engine="native").trace
    assert trace is not None
    ends = {"r": "reference.r", "r_ahead": "reference.r_lead", "y": "adc.y"}
    same_bits(lambda: called, {k: trace[end] for k, end in ends.items()}, trace["gain.y"])


def told(*words: str) -> str:
    done = invoked(["export", *words, "--controller"], status=2)
    assert done.output.count("\n") == 1, done.output
    return done.output


@pytest.mark.parametrize(("scenario", "sentence"), [
    ("stage/xy_raster", "One command must drive x. Got plant.y, plant_y.y."),
    ("open_loop", "A controller must drive plant. Got the source reference.r_lead."),
    ("example_tube", "A metric must have 'against', which names the plant. Got none."),
    ("example_jacobi --case in_parallel", "must be 'gauss_seidel' to export its controller. Got 'jacobi' instead."),
    ("pid --case none", "no case 'none'"),
])  # fmt: skip
def test_a_loop_without_one_controller(scenario: str, sentence: str, tmp_path: Path) -> None:
    name, *rest = scenario.split()
    assert sentence in told(str(ROOT / "scenarios" / name), *rest, "-o", str(tmp_path / "c.fmu"))
    assert not list(tmp_path.iterdir())


def test_foreign_units(tmp_path: Path) -> None:
    """A foreign plant is left out; a foreign controller cannot become a part of the unit."""
    gain = hy.Model("gain", hy.blocks.Scaling(gain=1.5).graph, H).export(tmp_path / "gain.fmu")
    plant = hy.Model("lag", hy.blocks.TransferFunction(b=[1.0], a=[0.02, 1.0]).graph, H).export(tmp_path / "lag.fmu")
    loop = hy.Scenario("small", step=H, stop=0.2).add("plant", plant).add("pid", hy.blocks.Pid(Ki=2.0))
    loop.add("reference", hy.blocks.Reference()).add("gain", hy.blocks.Scaling())
    for target, source in CONNECTED.items():
        loop.connect(source, target)
    loop.metric("tracking", "rms_percent", "plant.y", against="reference.r")
    assert {"pid", "gain"} < parts(made(loop, tmp_path))
    loop = small(wires={"fmu.u": "gain.y", "plant.u": "fmu.y"}).add("fmu", gain)
    with pytest.raises(hy.InputError, match=r"Its units must be blocks, models or graphs\. Got the FMU fmu"):
        loop.export_controller(tmp_path / "no.fmu")


@pytest.mark.turn("compiled loops")
@pytest.mark.some(1)
@pytest.mark.parametrize("fmi", [2, 3])
def test_in_the_place_of_its_units(fmi: int, tmp_path: Path) -> None:
    """The scenario with the FMU instead of the units that are in it has the same bits."""
    want = small().record("plant.y", "gain.y").run().trace
    fmu = small().export_controller(tmp_path / "c.fmu", fmi)  # type: ignore[arg-type]
    loop = hy.Scenario("small", step=H, stop=0.2).add("plant", hy.blocks.TransferFunction(b=[1.0], a=[0.02, 1.0]))
    loop.add("reference", hy.blocks.Reference(frequency=7.0, lead=2 * H)).add("controller", fmu)
    for port, end in (("r", "reference.r"), ("r_ahead", "reference.r_lead"), ("y", "plant.y")):
        loop.connect(end, f"controller.{port}")
    loop.connect("controller.u", "plant.u").metric("tracking", "rms_percent", "plant.y", against="reference.r")
    got = loop.record("plant.y", "controller.u").run().trace
    assert want is not None
    assert got is not None
    assert got["plant.y"].tobytes() == want["plant.y"].tobytes()
    assert got["controller.u"].tobytes() == want["gain.y"].tobytes()


def test_units_of_different_rates(tmp_path: Path) -> None:
    loop = small(wires={"slow.u": "gain.y", "plant.u": "slow.y"}).add("slow", hy.blocks.Scaling(), every=3)
    with pytest.raises(hy.InputError, match=r"must have one step\. Got pid 0\.001 s, gain 0\.001 s, slow 0\.003 s"):
        loop.export_controller(tmp_path / "c.fmu")


def test_two_measured_outputs(tmp_path: Path) -> None:
    wires = {"adc.u": "plant.y", "pid.y": "adc.y", "sum.u_1": "pid.u", "sum.u_2": "plant.y", "gain.u": "sum.y"}
    loop = small(wires=wires).add("adc", hy.blocks.Quantiser(q=0.01)).add("sum", hy.blocks.Sum())
    with pytest.raises(hy.InputError, match=r"It must read one measured output\. Got plant\.y, adc\.y"):
        loop.export_controller(tmp_path / "c.fmu")


def test_options_of_models_do_not_apply(tmp_path: Path) -> None:
    out = ["-o", str(tmp_path / "c.fmu")]
    assert "Got --step as well" in told(str(ROOT / "scenarios/pid"), "--step", "1", *out)
    assert "export --controller needs -o X.fmu, --c DIR, or both" in told(str(ROOT / "scenarios/pid"))
    done = invoked(["export", str(ROOT / "scenarios/pid"), *out], status=2)
    assert "--controller" in done.output
