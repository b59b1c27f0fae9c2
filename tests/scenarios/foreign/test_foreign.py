"""Foreign FMUs in a scenario: bits, parameters, numbers, what their code does, and what is refused."""

import contextlib
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from bad_fmu import DESCRIPTION, SLEEPS, SPINS, bad_fmu
from engines import ready
from reference_fmus import reference_fmu

import hystfmu as hy
from hystfmu import Graph, InputError, Node
from hystfmu.fmu.write.export import export_fmu
from hystfmu.scenario import Run, simulate
from hystfmu.scenario.engine.simulation import ENGINES, chunks_here
from hystfmu.scenario.outcome.trace import Stopped, Trace
from hystfmu.scenario.run_fmu import run_fmu
from hystfmu.scenario.system.foreign import Foreign


def add(loop: dict[str, Any], write: Any, fmi: int) -> Path:
    """The PID of the loop as a foreign FMU."""
    folder = write(loop)
    export_fmu(Graph.single(Node("pid", "pid", {}, loop["units"]["pid"]["values"])), folder / "pid.fmu", fmi=fmi)  # type: ignore[arg-type]
    return Path(folder)


@pytest.mark.parametrize("fmi", [2, 3])
def test_parameters_are_set_by_name_and_scaled(loop: Any, write: Any, fmi: int, cache: Path) -> None:
    loop["units"]["pid"]["set"] = {"Kp": "*1.5", "Ki": 1000.0}
    ours = simulate(ready(write(loop)), "native")
    add(loop, write, fmi)
    loop["units"]["pid"] = {"fmu": "pid.fmu", "inputs": {"u_ff": 0.125}, "set": {"Kp": "*1.5", "Ki": 1000}}
    system = ready(write(loop))
    for engine in ENGINES:
        theirs = Trace.joined(chunks_here(system, engine), system.n_steps + 1)  # type: ignore[arg-type]
        assert theirs["plant.y"].tobytes() == ours["plant.y"].tobytes()
    assert [p.name[0] != "." for p in cache.iterdir()] == [True]  # one archive, one folder, nothing half-made
    loop["units"]["pid"]["set"] = {"Kq": 1.0}
    with pytest.raises(InputError, match=r"units\.pid: no parameter 'Kq'; there are Kp"):
        ready(write(loop))


@pytest.mark.some(1)
@pytest.mark.parametrize("engine", ["fmpy", "native"])
@pytest.mark.parametrize(("defect", "message"), [
    pytest.param("abort()", "the process that ran bad crashed .SIGABRT.", marks=pytest.mark.stress),
    ("*(volatile int *)0 = 0", "the process that ran bad crashed .SIGSEGV."),
    (SLEEPS, "not finished after 1 s"),
    pytest.param(SPINS, "not finished after 1 s", marks=pytest.mark.stress),
    ("return fmi2Error", "bad refuses the step"),
])  # fmt: skip
def test_what_foreign_code_does_stays_in_its_process(
    loop: Any, write: Any, engine: str, defect: str, message: str
) -> None:
    if fmpy.platform not in ("linux64", "darwin64"):
        pytest.skip("builds a shared library for Linux or macOS")
    folder = write(loop)
    bad_fmu(folder / "bad.fmu", defect)
    loop["units"]["bad"] = {"fmu": "bad.fmu"}
    loop["order"].append("bad")
    loop["connections"]["bad.u"] = "reference.r"
    system = ready(write(loop))
    with pytest.raises(Stopped, match=message):
        simulate(system, run=Run(engine, seconds=1.0 if "finished" in message else 60.0))  # type: ignore[arg-type]


@pytest.mark.parametrize(("where", "steps", "hangs"), [
    pytest.param("local", 4, SLEEPS, marks=pytest.mark.stress),
    pytest.param("cluster", 2, SLEEPS, marks=pytest.mark.stress),
    pytest.param("local", 10, SPINS, marks=pytest.mark.stress),
    pytest.param("cluster of processes", 4, SPINS, marks=pytest.mark.stress),
])  # fmt: skip
def test_a_poison_and_an_endless_fmu_are_rows_of_a_study(
    loop: Any, write: Any, tmp_path: Path, where: str, steps: int, hangs: str
) -> None:
    """Amplitudes above the limit kill or stop their process; all other rows are those of a good FMU."""
    pytest.importorskip("pyarrow")
    distributed = pytest.importorskip("distributed")
    import tomli_w

    folder = write(loop)
    loop["units"]["bad"] = {"fmu": "bad.fmu"}
    loop["order"].append("bad")
    loop["connections"]["bad.u"] = "reference.r"
    loop["metrics"] = {"peak": {"kind": "peak", "signal": "bad.y"}}
    loop["stop"] = 0.01
    study = {
        "name": "bad",
        "scenario": ".",
        "method": "grid",
        "timeout": 4.0,
        "parameters": {"reference.amplitude": {"range": [0.2, 2.0], "steps": steps}},
    }
    (folder / "s.study.toml").write_text(tomli_w.dumps(study))
    write(loop)
    rows = {}
    with contextlib.ExitStack() as stack:
        place: dict[str, Any] = {"workers": 2}
        if where != "local":
            sizes: dict[str, Any] = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
            sizes |= {"processes": where.endswith("processes"), "protocol": "tcp://"}
            cluster = stack.enter_context(distributed.LocalCluster(**sizes, local_directory=str(tmp_path)))
            place = {"on": cluster.scheduler_address.replace("tcp://", "dask://")}
        for name, defect in (("good", "y = u"), ("killed", "abort()"), ("timeout", hangs)):
            bad_fmu(folder / "bad.fmu", defect, 1.65)
            rows[name] = hy.study(folder / "s.study.toml", tmp_path / name, **place).rows
    assert {r["status"] for r in rows["good"]} == {"ok"}
    for name in ("killed", "timeout"):
        for row, good in zip(rows[name], rows["good"], strict=True):
            if row["values"]["reference.amplitude"] < 1.7:
                assert row["metrics"] == good["metrics"]
            else:
                assert row["status"] == name
        assert sum(r["status"] == name for r in rows[name]) == sum(
            r["values"]["reference.amplitude"] > 1.7 for r in rows["good"]
        )


@pytest.mark.parametrize("name", ["../../evil.txt", "/evil.txt"])
def test_an_archive_that_would_write_elsewhere_is_refused(loop: Any, write: Any, cache: Path, name: str) -> None:
    folder = write(loop)
    with zipfile.ZipFile(folder / "evil.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION)
        archive.writestr(name, "x")
    loop["units"]["pid"] = {"fmu": "evil.fmu"}
    with pytest.raises(InputError, match="would be written outside"):
        ready(write(loop))
    assert list(cache.iterdir()) == []


@pytest.mark.turn("foreign units")
def test_unconnected_inputs_keep_their_start_values(loop: Any, write: Any) -> None:
    add(loop, write, 2)
    loop["units"]["pid"] = {"fmu": "pid.fmu"}  # u_ff has the start value 0
    del loop["connections"]["pid.y"]
    system = ready(write(loop))
    assert system.parts[2].constants == {"u_ff": 0.0, "y": 0.0}
    assert np.isfinite(simulate(system)["pid.u"]).all()


# ---- numbers ---------------------------------------------------------------------------------------------------------
H = 1e-3


def run(write: Any, engine: Any, defect: str) -> Trace:
    """Ten steps of a foreign FMU before a unit of ours, in this process; the defect shows from 5 ms on."""
    folder = write(
        {
            "name": "numbers",
            "step": H,
            "stop": 10 * H,
            "order": ["source", "bad", "sum"],
            "units": {
                "source": {"block": "reference", "values": {"shape": "steps", "T": 1.0, "levels": [1.0]}},
                "bad": {"fmu": "bad.fmu"},
                "sum": {"block": "sum", "dims": {"n": 1}, "values": {"k": [1.0]}},
            },
            "connections": {"bad.u": "source.r", "sum.u": "bad.y"},
            "metrics": {"p": {"kind": "peak", "signal": "sum.y"}},
        }
    )
    bad_fmu(folder / "bad.fmu", defect, 0.5, "#include <math.h>")
    system = ready(folder)
    return Trace.joined(chunks_here(system, engine), system.n_steps + 1)


@pytest.mark.some(0.5)
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("number", ["HUGE_VAL", "-HUGE_VAL", "NAN"])
def test_a_number_that_is_not_finite_stops_before_our_unit(write: Any, engine: str, number: str) -> None:
    with pytest.raises(Stopped, match=r"sum refuses the step .*"):
        run(write, engine, f"{{ y = {number}; return fmi2OK; }}")


@pytest.mark.some(1)
@pytest.mark.parametrize("engine", ENGINES)
def test_the_status_of_reading(write: Any, engine: str) -> None:
    """A warning is no failure, all else stops the run."""
    assert run(write, engine, "got = fmi2Warning")["sum.y"][-1] == 1
    for status in ("fmi2Discard", "fmi2Error"):
        with pytest.raises(Stopped, match="bad"):
            run(write, engine, f"got = {status}")


# ---- refused ---------------------------------------------------------------------------------------------------------
Edit = Callable[[str, bytes], tuple[str, bytes] | None]
XML = "modelDescription.xml"


def edited(folder: Path, edit: Edit, fmi: int = 2) -> Path:
    """Export a block and edit the files of the archive."""
    graph = Graph.single(Node("plays", "play_bank", {"n": 2})).with_step(1e-3)
    given, path = export_fmu(graph, folder / "given.fmu", fmi, "plays"), folder / "x.fmu"  # type: ignore[arg-type]
    with zipfile.ZipFile(given) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            if (file := edit(name, old.read(name))) is not None:
                new.writestr(*file)
    return path


def described(old: str, new: str) -> Edit:
    """Replace what matches a pattern in the model description."""

    def edit(name: str, content: bytes) -> tuple[str, bytes]:
        if name != XML:
            return name, content
        text, n = re.subn(old, new, content.decode())
        assert n > 0
        return name, text.encode()

    return edit


def moved(to: str) -> Edit:
    """Put what is in the folder of this platform elsewhere."""
    return lambda name, content: (re.sub(r"^binaries/[^/]*/plays", f"binaries/{to}", name), content)


@pytest.mark.parametrize(("edit", "there"), [
    (lambda n, c: None if n.startswith("binaries/") else (n, c), "it has no binaries"),
    (moved("vax64/plays"), "it has binaries for vax64"),
    (moved("{own}/other"), "there is other"),
])  # fmt: skip
@pytest.mark.parametrize("fmi", [2, 3])
def test_no_binary_for_this_platform(tmp_path: Path, edit: Edit, there: str, fmi: int) -> None:
    own = fmpy.platform if fmi == 2 else fmpy.platform_tuple
    path = edited(tmp_path, lambda n, c: (f := edit(n, c)) and (f[0].replace("{own}", own), f[1]), fmi)
    with pytest.raises(InputError) as e:
        Foreign.load(path)
    file = f"binaries/{own}/plays{fmpy.sharedLibraryExtension}"
    assert str(e.value).startswith(f"{path}: no binary for this platform: {file} is missing; {there}")
    assert str(e.value).endswith(f"Ask its maker for one for {own}.")


@pytest.mark.parametrize(("old", "new", "message"), [
    ('modelIdentifier="plays"', 'modelIdentifier="../../plays"', r"modelIdentifier must be the name of a file"),
    ('modelIdentifier="plays"', f'modelIdentifier="{"p" * 400}"', "no binary for this platform: .* is missing"),
    ('fmiVersion="2.0"', "", r"fmiVersion must be 1\.0, 2\.0 or 3\.0\. Got '' instead"),
    ("UTF-8", "UTF-7", "modelDescription.xml: "),
    ('valueReference="0"', 'valueReference="a"', r"\(line \d+.*valueReference': 'a' is not a valid value"),
    ('stopTime="[^"]*"', 'stopTime="soon"', r"stopTime must be a number\. Got 'soon' instead"),
    ('name="u"(.*\n.*)start="0.0"', r'name="u"\1start="zero"', r"u: the start value must be a number\. Got 'zero'"),
    ('name="u"', 'name="z_1"', r"names of their own\. 'z_1' occurs twice"),
])  # fmt: skip
def test_description_that_cannot_be_read(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = edited(tmp_path, described(old, new))
    with pytest.raises(InputError, match=message) as e:
        Foreign.load(path)
    assert str(e.value).startswith(f"{path}: ")
    assert "\n" not in str(e.value)
    assert len(str(e.value)) < 600


@pytest.mark.turn("foreign units")
def test_what_the_fmu_says_when_it_makes_no_instance(tmp_path: Path) -> None:
    path = edited(tmp_path, described('guid="', 'guid="another'))
    with pytest.raises(InputError, match=r"cannot be instantiated: .*The token 'another.* does not belong"):
        run_fmu(path)


# ---- called by types -------------------------------------------------------------------------------------------------
def in_all_engines(folder: Path) -> Trace:
    """Run a scenario by every engine and return what all of them give."""
    first, *others = (simulate(ready(folder), engine) for engine in ENGINES)
    for other in others:
        assert {k: other[k].tobytes() for k in first.columns} == {k: first[k].tobytes() for k in first.columns}
    return first


def feedthrough(loop: Any, write: Any, name: str) -> Path:
    """A scenario in which a reference drives an input of Feedthrough."""
    (write(loop) / "x.fmu").write_bytes(reference_fmu("fmi3/Feedthrough").read_bytes())
    loop["units"]["x"] = {"fmu": "x.fmu"}
    loop["order"].append("x")
    loop["connections"][f"x.{name}_input"] = "reference.r"
    loop["units"]["reference"]["values"]["amplitude"] = 3.0
    loop["stop"] = 0.02
    return Path(write(loop))


@pytest.mark.turn("foreign units")
@pytest.mark.some(1)
@pytest.mark.parametrize(("kind", "want"), [("Int16", np.round), ("Boolean", lambda r: (r >= 0.5).astype(float))])
def test_a_whole_number_is_the_nearest_and_a_boolean_true_from_one_half_on(
    loop: Any, write: Any, kind: str, want: Callable[[Any], Any]
) -> None:
    trace = in_all_engines(feedthrough(loop, write, kind))
    assert trace[f"x.{kind}_output"].tolist() == want(trace["reference.r"]).tolist()
    assert {0.0, 1.0} <= set(trace[f"x.{kind}_output"])


@pytest.mark.turn("foreign units")
@pytest.mark.some(1)
@pytest.mark.parametrize("engine", ENGINES)
def test_a_number_that_does_not_fit_stops_the_run(loop: Any, write: Any, engine: Any) -> None:
    folder = feedthrough(loop, write, "UInt8")
    with pytest.raises(Stopped, match=r"x refuses the step from t = 0.0\d+ s: UInt8_input: -0.\d+ does not fit the"):
        simulate(ready(folder), engine)


def test_sizes_that_a_scenario_sets(loop: Any, write: Any) -> None:
    (write(loop) / "x.fmu").write_bytes(reference_fmu("fmi3/StateSpace").read_bytes())
    sizes = {"m": 1, "n": 1, "r": 1}
    loop["units"]["x"] = {"fmu": "x.fmu", "set": sizes | {"A": [0.0], "B": [0.0], "C": [0.0], "D": [2.0]}}
    loop["order"].append("x")
    loop["connections"]["x.u"] = "reference.r"
    trace = in_all_engines(write(loop))
    assert trace["x.y"].tolist() == (2 * trace["reference.r"]).tolist()
    loop["units"]["x"]["set"]["D"] = [2.0, 1.0]
    with pytest.raises(InputError, match=r"units\.x: D: must have 1 elements; got 2"):
        ready(write(loop))


def test_fmi_1_in_both_engines(loop: Any, write: Any) -> None:
    (write(loop) / "x.fmu").write_bytes(reference_fmu("fmi1cs/Dahlquist").read_bytes())
    loop["units"]["x"] = {"fmu": "x.fmu", "set": {"k": "*2"}}
    loop["order"].append("x")
    loop["step"], loop["stop"] = 0.1, 1.0
    del loop["metrics"]["tracking"]["after"]
    assert np.abs(in_all_engines(write(loop))["x.x"] - 0.8 ** np.arange(11)).max() < 1e-14
    loop["coupling"] = {"scheme": "iterative"}
    with pytest.raises(Stopped, match="x: iterative coupling needs an FMU that can get and set its state"):
        simulate(ready(write(loop)))


@pytest.mark.turn("foreign units")
@pytest.mark.some(1)
@pytest.mark.parametrize("engine", ENGINES)
def test_an_adapted_fmu_is_never_asked_for_tangents(loop: Any, write: Any, engine: Any) -> None:
    """Set by types, it is called by no function for a tangent: a loop through it is solved by relaxation."""
    (write(loop) / "x.fmu").write_bytes(reference_fmu("fmi3/Feedthrough").read_bytes())
    loop["units"]["x"] = {"fmu": "x.fmu", "set": {}}
    loop["units"]["sum"] = {"block": "sum", "dims": {"n": 2}, "values": {"k": [1.0, -0.5]}}
    loop["order"] += ["x", "sum"]
    loop["connections"] |= {"sum.u_1": "reference.r", "sum.u_2": "x.Float64_continuous_output"}
    loop["connections"]["x.Float64_continuous_input"] = "sum.y"
    loop["stop"], loop["coupling"] = 0.005, {"scheme": "iterative"}
    del loop["metrics"]["tracking"]["after"]
    system = ready(write(loop))
    assert (system.parts[3].has_tangent, system.newton) == (False, False)
    trace = simulate(system, engine)
    assert trace["x.Float64_continuous_output"] == pytest.approx(trace["reference.r"] / 1.5, abs=1e-8)
    assert trace["x.Float64_continuous_output"] == pytest.approx(trace["sum.y"], abs=1e-8)


def test_final_states_of_a_foreign_fmu_are_refused_in_one_line(loop: Any, write: Any) -> None:
    folder = feedthrough(loop, write, "Boolean")
    loop["final_states"] = True
    write(loop)
    with pytest.raises(
        InputError, match=r"scenario\.toml: final_states: x is a foreign FMU, whose states are not known$"
    ):
        ready(folder)
