"""Other readers of SSP archives meet the reference inside: shipped scenarios, papers' loops, a foreign FMU."""

from collections.abc import Iterable
from pathlib import Path

import pytest
import tomli_w
from reference_fmus import reference_fmu
from ssp_readers import READERS, absent, error

from hystfmu.base.errors import InputError
from hystfmu.fmu import export_fmu
from hystfmu.graph import Graph, Node
from hystfmu.scenario import Cases
from hystfmu.scenario.ssp.write import write_ssp

SCENARIOS = Path(__file__).parents[3] / "scenarios"
SHIPPED = sorted(f.parent.relative_to(SCENARIOS).as_posix() for f in SCENARIOS.rglob("scenario.toml"))
FEW = ("pid", "adaptive", "papers/zhao_tan_2008", "papers/yu_alici_2005_smc", "example_tube")
BOUND = 1e-9  # of the span
REFUSED = {
    "example_hold": "has substeps or a hold",
    "example_substeps": "has substeps or a hold",
    "papers/ipmc_bfbnn_learning": "runs once in several steps",
}


@pytest.mark.parametrize("name", [pytest.param(n, marks=[] if n in FEW else pytest.mark.stress, id=n) for n in SHIPPED])
def test_a_shipped_scenario(name: str, tmp_path: Path) -> None:
    case = Cases(SCENARIOS / name).cases[0]
    if name in REFUSED:
        with pytest.raises(InputError, match=REFUSED[name]):
            write_ssp(case, tmp_path / "loop.ssp")
        return
    archive = write_ssp(case, tmp_path / "loop.ssp").path
    for reader in READERS:
        if not absent(reader):
            assert error(archive, reader, case.step, 1200) < BOUND, reader


def loop_with(fmu: Path, connections: dict[str, str], folder: Path) -> Path:
    """A scenario with a foreign FMU: reference, PID, FMU, lag."""
    units = {
        "reference": {"block": "reference", "values": {"shape": "sine", "amplitude": 1.0, "frequency": 5.0}},
        "pid": {"block": "pid", "values": {"Kp": 0.5, "Ki": 20.0}, "inputs": {"u_ff": 0.0}},
        "fmu": {"fmu": fmu.name},
        "lag": {"block": "transfer_function", "dims": {"na": 1, "nb": 0}, "values": {"b": [1.0], "a": [1e-2, 1.0]}},
    }
    data = {
        "name": "foreign_loop",
        "step": 1e-3,
        "stop": 0.5,
        "order": ["reference", "pid", "fmu", "lag"],
        "units": units,
        "connections": {"pid.y": "lag.y", **connections},
        "record": ["reference.r", "lag.y"],
        "metrics": {"worst": {"kind": "max_percent", "signal": "lag.y", "against": "reference.r", "limit": 100.0}},
    }
    (folder / "scenario.toml").write_text(tomli_w.dumps(data))
    return folder


# a plant for fmpy, a reference for the others: neither libcosim nor ecos loads the FMI 2.0 Feedthrough, and fmpy hands
# a 0 to every input of the first step, so that all initial values must be 0
FEEDTHROUGH = {
    "pid.y_d": "reference.r",
    "fmu.Float64_continuous_input": "pid.u",
    "lag.u": "fmu.Float64_continuous_output",
}
FMUS = {
    "Feedthrough": (["fmpy"], FEEDTHROUGH),
    "Dahlquist": (["libcosim", "ecos"], {"pid.y_d": "fmu.x", "lag.u": "pid.u"}),
}


def installed(readers: Iterable[str]) -> list[str]:
    """Those of the readers that are installed; without one the test is skipped."""
    found = [reader for reader in readers if not absent(reader)]
    if not found:
        pytest.skip(f"{', '.join(readers)}: not installed")
    return found


@pytest.mark.parametrize(
    ("name", "separate"),
    [
        ("Feedthrough", False),
        ("Dahlquist", True),
        *(pytest.param(*c, marks=pytest.mark.stress) for c in (("Feedthrough", True), ("Dahlquist", False))),
    ],
)
def test_a_loop_with_a_reference_fmu(name: str, separate: bool, tmp_path: Path) -> None:
    readers, connections = FMUS[name]
    found, original = installed(readers), reference_fmu(f"fmi2/{name}")
    (tmp_path / original.name).write_bytes(original.read_bytes())
    case = Cases(loop_with(original, connections, tmp_path)).cases[0]
    written = write_ssp(case, tmp_path / "loop.ssp", separate=separate)
    assert written.components == (4 if separate else 3)
    assert 0.1 < max(written.differences.values()) < 50  # steps of delay in the loop
    for reader in found:
        assert error(written.path, reader, case.step) < BOUND, reader


def test_a_loop_with_a_foreign_fmu(tmp_path: Path) -> None:
    plays = Node("plays", "backlash_sum", {}, {"w0": 0.3, "r": [0.1, 0.2, 0.3], "w": [0.3, 0.2, 0.1]})
    fmu = export_fmu(Graph.single(plays), tmp_path / "plays.fmu")
    connections = {"pid.y_d": "reference.r", "fmu.u": "pid.u", "lag.u": "fmu.y"}
    case = Cases(loop_with(fmu, connections, tmp_path)).cases[0]
    written = write_ssp(case, tmp_path / "loop.ssp")
    assert written.components == 3
    for reader in installed(READERS):
        assert error(written.path, reader, case.step) < BOUND, reader
