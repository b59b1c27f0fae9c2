"""A closed loop as an SSP archive: the same trajectory here, in libcosim, and in a container FMU."""

import shutil
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from click.testing import CliRunner
from engines import ready
from invoked import invoked
from lxml import etree

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.cli import main
from hystfmu.scenario import Cases, build, simulate
from hystfmu.scenario.engine.simulation import chunks_here
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.ssp.read import read_ssp, run_ssp
from hystfmu.scenario.ssp.write import REFERENCE, write_loop, write_ssp

SCHEMA = Path(fmpy.__file__).parent / "ssp" / "schema"


@pytest.fixture
def archive(loop: Any, write: Any, tmp_path: Path) -> Path:
    """The loop of this folder, every unit a component."""
    loop["units"]["pid"]["set"] = {"Kp": "*0.9"}
    loop["units"]["reference"]["values"]["shape"] = "sine"
    return write_ssp(Cases(write(loop)).cases[0], tmp_path / "loop.ssp", separate=True).path


def trajectory(archive: Path, scheme: str) -> Array:
    """plant.y of our own engine."""
    case = read_ssp(archive).case
    case = replace(case, coupling=case.coupling.model_copy(update={"scheme": scheme}))
    system = build(case)
    native, by_fmpy = (
        Trace.joined(chunks_here(system, e), system.n_steps + 1)["plant.y"]  # type: ignore[arg-type]
        for e in ("native", "fmpy")
    )
    assert native.tobytes() == by_fmpy.tobytes()
    return native


def traced(path: Path, step: float | None = None) -> Trace:
    """The trajectory of an archive."""
    return simulate(build(read_ssp(path, step).case), "native")


@pytest.mark.turn("systems of an SSP")
def test_neighbours_in_one_component_keep_the_trajectory_of_the_scenario(loop: Any, write: Any, tmp_path: Path) -> None:
    case = Cases(write(loop)).cases[0]
    written = write_ssp(case, tmp_path / "loop.ssp")
    assert written.components == 1
    assert set(written.differences) == {"reference.r", "plant.y"}
    assert max(written.differences.values()) < 1e-10  # percent of the span
    told = run_ssp(written.path, "native")
    assert told.passed
    assert told.lines()[0].endswith(f"2 signals agree with {REFERENCE}")
    own = simulate(ready(write(loop)), "native")["plant.y"]
    assert np.abs(traced(written.path)["loop.plant_y"] - own).max() < 1e-12


@pytest.mark.turn("systems of an SSP")
def test_separate_components_state_what_their_coupling_costs(
    archive: Path, loop: Any, write: Any, tmp_path: Path
) -> None:
    written = write_ssp(Cases(write(loop)).cases[0], tmp_path / "again.ssp", separate=True)
    late = trajectory(archive, "jacobi")
    own = simulate(build(Cases(write(loop)).cases[0]), "native")["plant.y"]
    assert written.components == 3
    assert written.differences["reference.r"] == 0
    assert written.differences["plant.y"] == pytest.approx(100 * np.abs(late - own).max() / np.ptp(own), rel=1e-12)
    assert written.differences["plant.y"] > 0.1
    told = run_ssp(archive, "native")
    assert told.passed
    assert told.lines()[0].endswith(f"2 signals agree with {REFERENCE}")
    assert traced(archive)["plant.y"].tobytes() == late.tobytes()


@pytest.mark.parametrize("tolerance", [None, "50"])
def test_an_archive_that_does_not_reproduce_the_scenario_is_no_success(
    loop: Any, write: Any, tmp_path: Path, tolerance: str | None
) -> None:
    out = tmp_path / "loop.ssp"
    command = ["ssp", str(write(loop)), "-o", str(out), "--separate", "-q"]
    done = CliRunner().invoke(main, [*command, *(["--tolerance", tolerance] if tolerance else [])])
    assert out.exists()
    if tolerance:
        assert (done.exit_code, done.output) == (0, "")
        return
    cost = write_ssp(Cases(write(loop)).cases[0], tmp_path / "again.ssp", separate=True).differences["plant.y"]
    assert done.exit_code == 1
    assert done.output == (
        f"{out}: does not reproduce the scenario within 0.1 % of the span: plant.y differs by {cost:.2g} %; the"
        " command has written the file in spite of this\n"
    )


def test_archive_and_fmus_say_of_which_scenario_they_are(loop: Any, write: Any, tmp_path: Path) -> None:
    """And an output that no record names is not described by the block that it leaves."""
    loop["text"] = "stage 7 on the bench"
    loop["units"]["plant"]["graph"]["outputs"][0]["unit"] = "um"
    case = Cases(write(loop)).cases[0]
    path = write_ssp(case, tmp_path / "loop.ssp").path
    with zipfile.ZipFile(path) as archive:
        structure = etree.fromstring(archive.read("SystemStructure.ssd"))
        (tmp_path / "part.fmu").write_bytes(archive.read("resources/loop.fmu"))
    whole = write_loop(case, tmp_path / "loop.fmu")
    for told in (
        structure.get("description"),
        fmpy.read_model_description(str(tmp_path / "part.fmu")).description,
        fmpy.read_model_description(str(whole)).description,
    ):
        assert f"scenario {case.title}" in told
        assert "stage 7 on the bench" in told
    ports = {v.name: v.description for v in fmpy.read_model_description(str(whole)).modelVariables}
    assert ports["plant_y"] == "y of plant, in um"


def test_the_values_of_the_case_stand_in_the_fmus(archive: Path, tmp_path: Path) -> None:
    """Several readers take no parameter sets of components; constant inputs are no connectors, so that none sets 0."""
    with zipfile.ZipFile(archive) as files:
        assert not [n for n in files.namelist() if n.endswith(".ssv")]
        structure = etree.fromstring(files.read("SystemStructure.ssd"))
        (tmp_path / "pid.fmu").write_bytes(files.read("resources/pid.fmu"))
    starts = {v.name: v.start for v in fmpy.read_model_description(str(tmp_path / "pid.fmu")).modelVariables}
    assert float(starts["Kp"]) == 0.9
    assert float(starts["u_ff"]) == 0.125
    pid = structure.find(".//{*}Component[@name='pid']")
    assert {c.get("name") for c in pid.iter("{*}Connector") if c.get("kind") == "input"} == {"y_d", "y"}


def test_connectors_have_units_of_measure(loop: Any, write: Any, tmp_path: Path) -> None:
    loop["units"]["plant"]["graph"]["inputs"][0]["unit"] = "V"
    loop["units"]["plant"]["graph"]["outputs"][0]["unit"] = "um"
    path = write_ssp(Cases(write(loop)).cases[0], tmp_path / "loop.ssp", separate=True).path
    structure = etree.fromstring(zipfile.ZipFile(path).read("SystemStructure.ssd"))
    plant = structure.find(".//{*}Component[@name='plant']")
    measures = {c.get("name"): c[0].get("unit") for c in plant.iter("{*}Connector")}
    assert (measures["u"], measures["y"]) == ("V", "um")
    base = {u.get("name"): dict(u[0].attrib) for u in structure.iter("{*}Unit")}
    assert base["um"] == {"m": "1", "factor": "1e-06"}
    assert base["V"] == {"kg": "1", "m": "2", "s": "-3", "A": "-1"}


@pytest.mark.turn("systems of an SSP")
def test_another_reference_is_noticed(archive: Path, tmp_path: Path) -> None:
    changed = tmp_path / "changed.ssp"
    with zipfile.ZipFile(archive) as old, zipfile.ZipFile(changed, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            new.writestr(name, content.replace(b"\n0.02,", b"\n0.02,1") if name == REFERENCE else content)
    assert [x for x in run_ssp(changed, "native").faults if "differs from" in x]
    result = invoked(["simulate", str(changed), "--engine", "native"], status=1)
    assert "reference.r" in result.output


def test_libcosim_runs_the_archive(archive: Path, tmp_path: Path) -> None:
    """libcosim counts whole nanoseconds: its times differ from k h in the last bit, and so does the sine of the
    reference.
    """
    pytest.importorskip("libcosimpy")
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    zipfile.ZipFile(archive).extractall(tmp_path / "unpacked")
    execution = CosimExecution.from_ssp_file(str(tmp_path / "unpacked" / "SystemStructure.ssd"))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    plant = {s.name.decode(): s.index for s in execution.slave_infos()}["plant"]
    y = {v.name.decode(): v.reference for v in execution.slave_variables(plant)}["y"]
    ours = trajectory(archive, "jacobi")
    theirs = []
    for _ in ours:
        theirs.append(observer.last_real_values(plant, [y])[0])
        execution.step()
    assert np.ptp(theirs) > 0.5
    assert np.abs(np.array(theirs) - ours).max() < 1e-13


def test_a_container_fmu_of_the_archive_has_the_same_bits(archive: Path, tmp_path: Path) -> None:
    """The toolbox makes containers of SSP archives with parallel scheduling, which is Jacobi's coupling."""
    pytest.importorskip("fmu_manipulation_toolbox")
    shutil.copy(archive, tmp_path / "box.ssp")
    start = "from fmu_manipulation_toolbox.cli.fmucontainer import fmucontainer; fmucontainer()"
    words = ["-container", "box.ssp:1e-4", "-fmu-directory", str(tmp_path), "-auto-local"]
    done = subprocess.run([sys.executable, "-c", start, *words], cwd=tmp_path, capture_output=True, text=True)
    (container,) = tmp_path.glob("box.fmu")
    description = fmpy.read_model_description(str(container), validate=False)
    y = "plant.y"
    assert y in [v.name for v in description.modelVariables], done.stdout
    ours = trajectory(archive, "jacobi")
    n = len(ours) - 1
    result = fmpy.simulate_fmu(
        str(container), stop_time=n * 1e-4, step_size=1e-4, output_interval=1e-4, output=[y], fmi_type="CoSimulation"
    )
    assert np.array_equal(result[y], ours)


@pytest.mark.some(1)
@pytest.mark.parametrize("connectors", [False, True])
@pytest.mark.parametrize("separate", [False, True])
def test_the_files_follow_the_schema(loop: Any, write: Any, tmp_path: Path, connectors: bool, separate: bool) -> None:
    case, path = Cases(write(loop)).cases[0], tmp_path / "loop.ssp"
    write_ssp(case, path, system_connectors=connectors, separate=separate)
    with zipfile.ZipFile(path) as archive:
        for name in archive.namelist():
            if name.endswith((".ssd", ".ssv")):
                kind = "Description" if name.endswith(".ssd") else "ParameterValues"
                schema = etree.XMLSchema(etree.parse(str(SCHEMA / f"SystemStructure{kind}.xsd")))
                schema.assertValid(etree.fromstring(archive.read(name)))
        structure = archive.read("SystemStructure.ssd")
    outputs = etree.fromstring(structure).xpath("/*/*[local-name()='System']/*[local-name()='Connectors']/*/@name")
    end = "plant_y" if separate else "loop_plant_y"
    assert (end in outputs) is connectors
    assert run_ssp(path, "native").passed


@pytest.mark.turn("systems of an SSP")
@pytest.mark.some(1)
@pytest.mark.parametrize("fmi", [2, 3])
def test_version_2(loop: Any, write: Any, tmp_path: Path, fmi: Any) -> None:
    path = write_ssp(Cases(write(loop)).cases[0], tmp_path / "loop.ssp", version="2.0", fmi=fmi).path
    assert b'version="2.0"' in zipfile.ZipFile(path).read("SystemStructure.ssd")
    assert run_ssp(path, "native").passed


@pytest.mark.parametrize(("old", "new", "message"), [
    (b'startConnector="u"', b'startConnector="q"', "names pid.q, which does not exist"),
    (b'name="plant"', b'name="pl ant"', "a component must have a unique name"),
    (b"<ssd:Elements>", b"<ssd:Elements><ssd:System name='x'/>", "components must not be nested"),
    (b"1e-04", b"soon", "must be a number"),
    (b"</ssd:System>", b"", "SystemStructure.ssd: "),
])  # fmt: skip
def test_what_is_not_understood_is_refused(archive: Path, tmp_path: Path, old: bytes, new: bytes, message: str) -> None:
    bad = tmp_path / "bad.ssp"
    with zipfile.ZipFile(archive) as source, zipfile.ZipFile(bad, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == "SystemStructure.ssd":
                content = content.replace(b"0.0001", b"1e-04")
                assert old in content
                content = content.replace(old, new)
            target.writestr(name, content)
    result = invoked(["simulate", str(bad)], status=2)
    assert message in result.output
    assert len(result.output.splitlines()) == 1


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_the_loop_as_one_fmu(loop: Any, write: Any, tmp_path: Path, fmi: str) -> None:
    folder, out = write(loop), tmp_path / "loop.fmu"
    invoked(["ssp", str(folder), "--fmi", fmi, "-o", str(out)])
    ours = simulate(ready(folder), "native")["plant.y"]
    trace = fmpy.simulate_fmu(
        str(out), stop_time=0.03, step_size=1e-4, output_interval=1e-4, output=["plant_y"], fmi_type="CoSimulation"
    )
    assert np.abs(trace["plant_y"] - ours).max() < 1e-13  # fmpy adds up its times in another way


def test_a_loop_that_does_not_reach_its_end_has_no_fmu(loop: Any, write: Any, tmp_path: Path) -> None:
    """No FMU runs away with status OK, where its own scenario does not end."""
    values = {"b": [1.0], "a": [1e-5, -1.0]}
    loop["units"]["runaway"] = {"block": "transfer_function", "dims": {"na": 1, "nb": 0}, "values": values}
    loop["order"].append("runaway")
    loop["connections"]["runaway.u"] = "pid.u"
    folder, out = write(loop), tmp_path / "loop.fmu"
    result = invoked(["ssp", str(folder), "-o", str(out)], status=2)
    (line,) = result.output.splitlines()
    assert "a loop must run to its end for the export: " in line
    assert not out.exists()


@pytest.mark.parametrize(("unit", "change", "said"), [
    ("pid", {"every": 2}, "pid must run in every step, because SSP has one step"),
    ("plant", {"substeps": 2}, "plant must have no substeps and no hold, which SSP does not support"),
    ("", {"scheme": "iterative"}, "the coupling must not be iterative, which SSP does not support"),
])  # fmt: skip
def test_what_no_reader_of_an_ssp_does_is_refused(
    loop: Any, write: Any, tmp_path: Path, unit: str, change: dict[str, Any], said: str
) -> None:
    (loop["units"][unit] if unit else loop.setdefault("coupling", {})).update(change)
    with pytest.raises(InputError, match=said):
        write_ssp(Cases(write(loop)).cases[0], tmp_path / "loop.ssp")
    assert not (tmp_path / "loop.ssp").exists()


def test_a_loop_that_the_coupling_of_readers_breaks_is_refused(loop: Any, write: Any, tmp_path: Path) -> None:
    loop["units"]["pid"]["set"] = {"Kp": 1e6, "u_min": -1e308, "u_max": 1e308}
    loop["stop"] = 1.0
    case = Cases(write(loop)).cases[0]
    with pytest.raises(InputError, match=r"with the coupling of SSP readers \(Jacobi\): .*; one FMU"):
        write_ssp(case, tmp_path / "loop.ssp", separate=True)
