"""Scenarios built in Python: the same bits as from TOML, defaults, errors that name the unit and the key."""

from pathlib import Path

import numpy as np
import pytest

import hystfmu as hy
from hystfmu.scenario import Cases as Cases
from hystfmu.scenario import build, simulate
from hystfmu.studies.task import fingerprint

SHIPPED = Path(__file__).parents[2] / "scenarios"


@pytest.fixture(scope="module")
def plant() -> hy.Model:
    return hy.fit(hy.synthetic.piezo(60, 1000.0), "prandtl_ishlinskii", N=20)


def tracking(plant: hy.Model, step: float = 1e-4) -> hy.Scenario:
    loop = hy.Scenario("tracking", step=step)
    loop.add("plant", plant, fine=True)
    loop.add("inverse", plant.inverse())
    loop.add("pid", hy.blocks.Pid(Kp=1.2, Ki=9e3))
    loop.connect("reference.r_lead", "inverse.u")
    loop.connect("reference.r", "pid.y_d")
    loop.connect("inverse.y", "pid.u_ff")
    loop.connect("plant.y", "pid.y")
    loop.connect("pid.u", "plant.u")
    return loop.metric("tracking", "rms_percent", "plant.y", against="reference.r", limit=0.05)


def values(cases: Cases, engine: str) -> list[bytes]:
    return [simulate(build(c), engine).values.tobytes() for c in cases.cases]  # type: ignore[arg-type]


@pytest.mark.turn("scenarios of the face")
@pytest.mark.some(1)
@pytest.mark.parametrize("engine", ["fmpy", "native"])
def test_built_saved_and_read_it_has_the_same_bits(plant: hy.Model, tmp_path: Path, engine: str):
    loop = tracking(plant).case("nominal", stop=0.02, after=0.0)
    loop.case("soft", stop=0.02, after=0.0, set={"plant.hysteresis_w": "*0.9", "pid.Ki": 100.0}, limits={"tracking": 5})
    implicit = plant.inverse("implicit")
    loop.case("other", stop=0.02, after=0.0, units={"inverse": implicit, "pid": hy.blocks.Pid(Kp=0.5)})
    folder = loop.save(tmp_path / "mine")
    built = values(loop.ready(), engine)
    assert built == values(Cases(folder), engine) == values(hy.Scenario.load(folder).ready(), engine)
    assert len(set(built)) == 3
    result = loop.run("soft", engine=engine)  # type: ignore[arg-type]
    (read,) = hy.run(folder, case="soft", engine=engine)  # type: ignore[arg-type]
    assert [v.value for v in result.verdicts] == [v.value for v in read.verdicts]


def test_the_default_reference_spans_the_stroke_and_tells_the_end(plant: hy.Model):
    loop = tracking(plant)
    (case,) = loop.ready().cases
    assert case.order == ("reference", "plant", "inverse", "pid")
    assert case.stop == pytest.approx(0.3)
    assert case.metrics["tracking"].after == pytest.approx(0.1)
    assert case.record == ("reference.r", "plant.y")
    result = loop.run()
    assert result.passed
    assert result.trace is not None
    r = result.trace["reference.r"]
    u = np.linspace(*plant.provenance["span_u"], 500)
    stroke = np.ptp(plant.predict(np.concatenate([u[::-1], u, u[::-1]]))[500:])
    assert np.ptp(r) == pytest.approx(0.8 * stroke, rel=1e-3)
    assert repr(result) == f"Result('tracking/nominal', passed, tracking = {result.verdicts[0].value:.4g} % <= 0.05)"
    assert len(repr(result.trace)) < 100


def test_results_show_plot_and_report(plant: hy.Model, tmp_path: Path):
    loop = tracking(plant).loop("pid.u", "plant.y").record("plant.y")
    result = loop.run(engine="native")
    assert [p.title.split(",")[0] for p in result.plot().plots][:2] == ["Tracking error", "Loops"]
    assert result.report(tmp_path / "out").exists()
    assert "tracking" in result._repr_html_()
    assert result.plot().save(tmp_path / "figure.svg").exists()
    tight = hy.run(tracking(plant).case("a", limits={"tracking": 0.0}).case("b"), engine="native")
    assert not tight.passed
    assert repr(tight) == "Results(2 cases, 1 passed; failed: tracking/a)"
    assert "exceeds the limit 0" in tight._repr_html_()


def test_a_shipped_scenario_is_read_run_changed_and_saved_elsewhere(tmp_path: Path):
    loop = hy.Scenario.load(SHIPPED / "cascade_static")
    assert loop.cases == tuple(c.name for c in Cases(SHIPPED / "cascade_static").cases)
    first = loop.cases[0]
    result = loop.run(first, engine="native")
    assert result.passed
    assert all(v.same for v in result.verdicts)  # against the baseline
    with pytest.raises(hy.InputError, match="The case of run\\(\\) must be one of"):
        loop.run()
    folder = loop.save(tmp_path / "copy")
    copied = Cases(folder)
    assert values(copied, "native") == values(Cases(SHIPPED / "cascade_static"), "native")
    loop.metric("largest", "peak", loop.ready().spec.record[0])
    changed = loop.run(first, engine="native")
    assert [v.baseline for v in changed.verdicts] == [None] * len(changed.verdicts)
    assert changed.passed
    with pytest.raises(hy.InputError, match="Save the scenario first"):
        hy.run(loop, engine="native", record=True)


@pytest.mark.turn("scenarios of the face")
@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["cascade_learned", "sliding_mode_2005_1khz"])
def test_a_copy_of_a_shipped_scenario_runs_the_same_systems(name: str, tmp_path: Path):
    folder = hy.Scenario.load(SHIPPED / name).save(tmp_path / "copy")
    made, shipped = ([fingerprint(build(c)) for c in Cases(f).cases] for f in (folder, SHIPPED / name))
    assert made == shipped


@pytest.mark.turn("scenarios of the face")
def test_a_unit_may_be_a_block_a_node_a_graph_a_file_or_an_fmu(plant: hy.Model, tmp_path: Path):
    plant.save(tmp_path / "p.model.toml")
    plant.export(tmp_path / "p.fmu")
    stepped = hy.Graph.single(hy.Node("wait", "delay", {"n": 2})).with_step(1e-4)
    chain = hy.Scenario("chain", step=1e-4, stop=0.005)
    chain.add("source", hy.Node("sine", "reference", {}, {"frequency": np.float64(200.0), "levels": np.ones(10)}))
    chain.add("memory", tmp_path / "p.model.toml").add("foreign", str(tmp_path / "p.fmu"))
    chain.add("gain", hy.Graph.single(hy.Node("gain", "sum", {"n": 1}, {"k": [2.0]})), runs_as="fmu3")
    chain.add("wait", stepped, text="two steps")
    for reader in ("memory", "foreign", "gain", "wait"):
        chain.connect("source.r", f"{reader}.u")
    chain.metric("same", "max_percent", "foreign.y", against="memory.y", limit=0.0)
    folder = chain.save(tmp_path / "chain")
    assert {p.name for p in folder.iterdir()} == {
        "scenario.toml", "memory.model.toml", "foreign.fmu", "wait.model.toml",
    }  # fmt: skip
    assert hy.run(folder).passed


@pytest.mark.parametrize(("wrong", "words"), [
    (lambda s, m: s.add("pid", m), "scenario 'tracking': units.pid: The name of a unit must occur once"),
    (lambda s, m: s.add("x", 3), "scenario 'tracking': units.x: A unit must be a model, a block"),
    (lambda s, m: s.add("x", "x.txt"), "scenario 'tracking': units.x: The path must end in"),
    (lambda s, m: s.add("x y", m).ready(), "scenario 'tracking': units.x y"),
    (lambda s, m: s.add("x", m, every=0).ready(), "scenario 'tracking': units.x: every: .*Got 0 instead"),
    (lambda s, m: build(s.add("x", m).ready().cases[0]), "nothing is connected to 'x.u'"),
    (lambda s, m: s.connect("pid", "x.y"), "must read 'unit.variable'; got 'pid'"),
    (lambda s, m: s.connect("pid.u", "plant.u"), "'plant.u' must have one source. Got 'pid.u' and 'pid.u'"),
    (lambda s, m: build(s.connect("plant.u", "plant.x").ready().cases[0]), "no input 'plant.x'"),
    (lambda s, m: s.metric("m", "mean", "plant.y").ready(), "scenario 'tracking': metrics.m.kind"),
    (lambda s, m: s.metric("m", "rms_percent", "plant.y").ready(), "rms_percent needs 'against'"),
    (lambda s, m: s.case("a", set={"gone.w": 1.0}).ready(), "case a: set: no unit 'gone'"),
    (lambda s, m: s.order("plant").ready(), "order: must name every unit once"),
    (lambda s, m: hy.Scenario("tracking", step=1e-4).ready(), "must have a unit. Got none; add"),
    (lambda s, m: hy.Scenario("tracking", step=1e-4).add("plant", m).ready(), "must have a metric. Got none; metric"),
    (lambda s, m: hy.Scenario("tracking", step=1e-4).add("plant", m).metric("p", "peak", "plant.y").ready(),
     "stop: The end of the run must be given"),
    (
        lambda s, m: (
            hy.Scenario("tracking", step=1e-4)
            .add("plant", hy.blocks.Creep())
            .metric("e", "final", "plant.y", against="reference.r")
            .ready()
        ),
        "The stroke of 'plant' must be known",
    ),
    (lambda s, m: hy.Scenario("tracking", step="1e-4"), "The step must be a float"),
    (lambda s, m: hy.Scenario("scenario 'tracking': no", step=1e-4), "The name must be a letter"),
    (lambda s, m: hy.Scenario("tracking", step=0.0).add("p", m).metric("p", "peak", "p.y").ready(), "step"),
])  # fmt: skip
def test_an_error_names_scenario_unit_and_key(plant: hy.Model, wrong, words: str):
    with pytest.raises(hy.InputError, match=words) as e:
        wrong(tracking(plant), plant)
    assert "scenario 'tracking'" in str(e.value)
    assert "scenario.toml" not in str(e.value)
    assert "\n" not in str(e.value)


def test_a_controller_that_is_wired_in_part_takes_the_rest_of_its_roles():
    """As if all wires were given: reference, measured output, no feed-forward, learning always."""

    def loop(**wires: str) -> hy.Scenario:
        made = hy.Scenario("part", step=1e-4, stop=0.05)
        made.add("plant", hy.blocks.Scaling()).add("late", hy.blocks.Delay(n=1))
        made.add("reference", hy.blocks.Reference(frequency=100.0)).add(
            "learns", hy.blocks.Repetitive(n=100, n_l=0, l=[0.1])
        )
        made.add("law", hy.blocks.Pid(Ki=50.0))
        for source, target in (("law.u", "late.u"), ("late.y", "plant.u"), ("learns.r", "law.y_d")):
            made.connect(source, target)
        for target, source in wires.items():
            made.connect(source, target.replace("__", "."))
        return made.metric("tracking", "rms_percent", "plant.y", against="reference.r")

    whole = loop(law__y="plant.y", learns__y="plant.y", learns__y_d="reference.r")
    whole.add("always", hy.blocks.Scaling(offset=1.0), inputs={"u": 0.0}).connect("always.y", "learns.active")
    whole.add("none", hy.blocks.Scaling(), inputs={"u": 0.0}).connect("none.y", "law.u_ff")
    whole.order("always", "none", "plant", "late", "reference", "learns", "law")
    part = loop().run(engine="native").trace
    assert part["plant.y"].tobytes() == whole.run(engine="native").trace["plant.y"].tobytes()
    assert loop().table["units"]["law"]["inputs"] == {"u_ff": 0.0}
