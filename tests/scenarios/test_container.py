"""A loop with foreign FMUs as one FMU: the bits of `hystfmu run`; errors name the unit."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from click.testing import CliRunner
from engines import ready
from fmpy.fmi2 import FMU2Slave, defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

from hystfmu.base.arrays import Array
from hystfmu.cli import main
from hystfmu.fmu.write.export import export_fmu
from hystfmu.graph import Graph, Node
from hystfmu.scenario import simulate

PLAYS = Node("plays", "backlash_sum", {}, {"w0": 0.3, "r": [0.1, 0.2, 0.3], "w": [0.3, 0.2, 0.1]})


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HYSTFMU_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def foreign(loop: Any, write: Any) -> Any:
    """Writes the loop with its PID as a foreign FMU, and the plays as another before the plant."""

    def make(fmi: int = 2, coupling: str = "gauss_seidel", **changes: Any) -> Path:
        loop["units"]["reference"]["values"]["shape"] = "sine"
        folder = Path(write(loop))
        pid = Node("pid", "pid", {}, loop["units"]["pid"]["values"])
        export_fmu(Graph.single(pid), folder / "pid.fmu", fmi)  # type: ignore[arg-type]
        export_fmu(Graph.single(PLAYS), folder / "plays.fmu", fmi)  # type: ignore[arg-type]
        loop["units"]["pid"] = {"fmu": "pid.fmu", "inputs": {"u_ff": 0.125}, "set": {"Ki": 1500.0}}
        loop["units"]["plays"] = {"fmu": "plays.fmu"}
        loop["order"] = ["plays", "plant", "reference", "pid"]
        loop["connections"] |= {"plays.u": "pid.u", "plant.u": "plays.y"}
        loop["coupling"] = {"scheme": coupling, "events": "grid"}
        loop.update(changes)
        return Path(write(loop))

    return make


def written(folder: Path, out: Path) -> None:
    result = CliRunner().invoke(main, ["ssp", str(folder), "-o", str(out)])
    assert result.exit_code == 0, result.output


def stepped(fmu: Path, folder: Path, h: float, n: int) -> dict[str, Array]:
    """Rows 0 to n of all outputs; steps of h at t = k h."""
    description = fmpy.read_model_description(str(fmu))
    slave = FMU2Slave(
        guid=description.guid,
        modelIdentifier=description.coSimulation.modelIdentifier,
        unzipDirectory=fmpy.extract(str(fmu), str(folder)),
        instanceName="box",
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    names = [v.name for v in description.modelVariables]
    references = [v.valueReference for v in description.modelVariables]
    rows = [slave.getReal(references)]
    for k in range(n):
        slave.doStep(k * h, h)
        rows.append(slave.getReal(references))
    slave.terminate()
    slave.freeInstance()
    return dict(zip(names, np.array(rows).T, strict=True))


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("coupling", ["gauss_seidel", "jacobi"])
def test_the_container_has_the_bits_of_the_run(foreign: Any, tmp_path: Path, fmi: int, coupling: str) -> None:
    folder = foreign(fmi, coupling)
    written(folder, tmp_path / "box.fmu")
    system = ready(folder)
    ours = simulate(system, "native")
    got = stepped(tmp_path / "box.fmu", tmp_path / "box", 1e-4, system.n_steps)
    for end in system.columns:
        assert got[end.replace(".", "_")].tobytes() == ours[end].tobytes(), end
    assert np.ptp(ours["plant.y"]) > 0.1


def test_fine_units_and_several_steps_at_once(foreign: Any, loop: Any, tmp_path: Path) -> None:
    loop["units"]["plant"]["fine"] = True
    folder = foreign(ripple=4)
    written(folder, tmp_path / "box.fmu")
    system = ready(folder)
    ours = simulate(system, "native")["plant.y"][::12]
    got = stepped(tmp_path / "box.fmu", tmp_path / "box", 3e-4, len(ours) - 1)["plant_y"]
    assert got.tobytes() == ours.tobytes()


@pytest.mark.parametrize("version", [2, 3])
def test_a_reference_fmu_in_a_container(loop: Any, write: Any, measured: Path, tmp_path: Path, version: int) -> None:
    """Feedthrough between controller and plant: foreign code, and the bits of `hystfmu run`."""
    original = measured / "reference_fmus" / f"fmi{version}" / "Feedthrough.fmu"
    if not original.exists():
        pytest.skip(f"no {original}")
    loop["units"]["wire"] = {"fmu": "Feedthrough.fmu"}
    loop["order"] = ["wire", "plant", "reference", "pid"]
    ends = {"wire.Float64_continuous_input": "pid.u", "plant.u": "wire.Float64_continuous_output"}
    loop["connections"] |= ends
    loop["coupling"] = {"events": "grid"}
    folder = Path(write(loop))
    (folder / "Feedthrough.fmu").write_bytes(original.read_bytes())
    written(folder, tmp_path / "box.fmu")
    system = ready(folder)
    ours = simulate(system, "native")
    got = stepped(tmp_path / "box.fmu", tmp_path / "box", 1e-4, system.n_steps)
    assert got["plant_y"].tobytes() == ours["plant.y"].tobytes()
    assert not [n for n in got if "Boolean" in n]


def test_signals_that_are_no_real_numbers_cannot_be_connected(
    loop: Any, write: Any, measured: Path, tmp_path: Path
) -> None:
    original = measured / "reference_fmus" / "fmi3" / "Feedthrough.fmu"
    if not original.exists():
        pytest.skip(f"no {original}")
    loop["units"]["wire"] = {"fmu": "Feedthrough.fmu"}
    loop["order"] = ["plant", "reference", "pid", "wire"]
    loop["connections"]["wire.Int32_input"] = "pid.u"
    folder = Path(write(loop))
    (folder / "Feedthrough.fmu").write_bytes(original.read_bytes())
    result = CliRunner().invoke(main, ["ssp", str(folder), "-o", str(tmp_path / "box.fmu")])
    assert result.exit_code == 2
    assert "wire.Int32_input: a container connects real inputs and outputs" in result.output


def tried(folder: Path) -> list[str]:
    """What an instance logs when it is made and makes a step; nothing if all goes well."""
    said: list[str] = []
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = fmi2CallbackLoggerTYPE(lambda _c, _n, _s, _k, m: said.append(m.decode()))
    callbacks.allocateMemory, callbacks.freeMemory = defaultCallbacks.allocateMemory, defaultCallbacks.freeMemory
    description = fmpy.read_model_description(str(folder), validate=False)
    slave = FMU2Slave(
        guid=description.guid,
        modelIdentifier=description.coSimulation.modelIdentifier,
        unzipDirectory=str(folder),
        instanceName="box",
    )
    try:
        slave.instantiate(callbacks=callbacks)
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        slave.doStep(0.0, 1e-4)
    except Exception:
        assert said
    if slave.component is not None:
        slave.freeInstance()
    return said


def test_errors_name_the_unit(foreign: Any, tmp_path: Path) -> None:
    written(foreign(), tmp_path / "box.fmu")
    box = Path(fmpy.extract(str(tmp_path / "box.fmu"), str(tmp_path / "box")))
    library = next((box / "resources" / "units" / "plays" / "binaries").rglob("*.so"))
    library.write_bytes(b"no library")
    (line,) = tried(box)
    assert line.startswith("unit 'plays': its library cannot be loaded: ")
    system = box / "resources" / "system.txt"
    system.write_text(system.read_text().replace("Gauss", "").replace("coupling 0", "coupling 7"))
    (line,) = tried(box)
    assert line.startswith("resources/system.txt is damaged near its byte")


def test_a_damaged_system_file_never_crashes(foreign: Any, tmp_path: Path) -> None:
    """Every tenth word cut away, doubled or replaced: a sentence, or a system that is whole."""
    written(foreign(), tmp_path / "box.fmu")
    box = Path(fmpy.extract(str(tmp_path / "box.fmu"), str(tmp_path / "box")))
    file = box / "resources" / "system.txt"
    words, refused = file.read_text().split(" "), 0
    for k in range(1, len(words), 10):
        for new in ([], ["-1"], ["99999999999"], [words[k], words[k]]):
            file.write_text(" ".join([*words[:k], *new, *words[k + 1 :]]))
            said = tried(box)
            assert len(said) <= 1, (k, new, said)
            refused += len(said)
    assert refused > 30


def test_what_a_container_cannot_step_is_refused(foreign: Any, loop: Any, tmp_path: Path) -> None:
    folder = foreign(coupling="iterative")
    result = CliRunner().invoke(main, ["ssp", str(folder), "-o", str(tmp_path / "box.fmu")])
    assert result.exit_code == 2
    assert "a container steps in order or all at once, not with iterative coupling" in result.output
    result = CliRunner().invoke(main, ["ssp", str(folder), "--fmi", "3", "-o", str(tmp_path / "box.fmu")])
    assert "a loop with foreign FMUs becomes an FMU 2.0" in result.output
    assert not (tmp_path / "box.fmu").exists()


def test_the_archive_passes_the_checks_of_fmpy(foreign: Any, tmp_path: Path) -> None:
    from fmpy.validation import validate_fmu

    written(foreign(), tmp_path / "box.fmu")
    assert validate_fmu(str(tmp_path / "box.fmu")) == []
    with zipfile.ZipFile(tmp_path / "box.fmu") as archive:
        names = archive.namelist()
    assert "resources/units/pid/modelDescription.xml" in names
    assert sum(n.endswith(".so") for n in names) == 4  # of the container, of both foreign FMUs, one of all of ours
