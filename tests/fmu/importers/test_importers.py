"""Every key of METHODS and each of its inverses, as FMI 2.0 and FMI 3.0 FMU, in every importer available."""

import re
import zipfile
from collections.abc import Iterable
from pathlib import Path

import fmpy
import numpy as np
import pytest
import tomli_w
from fmpy import simulate_fmu
from fmu_master import Array, loop, rows, single
from reference_fmus import reference_fmu
from runners import READERS, absent, clock, error, run_by_fmpy, run_by_libcosim, run_by_unit, run_in_container
from test_keys import KEYS, LEARNED, REFUSED, H, fitted_model, signal_for

import hystfmu as hy
from hystfmu import Graph, InputError, Model, Node, signals
from hystfmu.fmu import export_fmu
from hystfmu.identify import METHODS
from hystfmu.inverse import METHODS as WAYS
from hystfmu.inverse import inverse
from hystfmu.scenario import Cases
from hystfmu.scenario.ssp.write import write_ssp
from hystfmu.scenario.system.spec import shipped_scenarios

PAGE = Path(__file__).parents[3] / "python" / "docs" / "importers.md"
SCHEMAS = Path(fmpy.__file__).parent / "schema"
FILES = {
    2: {"modelDescription.xml": "fmi2/fmi2ModelDescription.xsd"},
    3: {
        "modelDescription.xml": "fmi3/fmi3ModelDescription.xsd",
        "terminalsAndIcons/terminalsAndIcons.xml": "fmi3/fmi3TerminalsAndIcons.xsd",
        "sources/buildDescription.xml": "fmi3/fmi3BuildDescription.xsd",
    },
}
# operators with and without exact inverse, samples, continuous states; libcosim reads FMI 2.0 only
SLICE = [
    ("prandtl_ishlinskii", "", 3),
    ("prandtl_ishlinskii", "exact", 2),
    ("polynomial_narx", "", 2),
    ("bouc_wen_oscillator", "", 3),
]
CASES = [(key, way, fmi) for key in METHODS for way in ("", *WAYS) if way != "adaptive" for fmi in (2, 3)]
LONG = [pytest.param(*c, marks=pytest.mark.stress) for c in CASES if c not in SLICE]


def model_of(key: str, way: str, fitted: dict[str, Model]) -> Model:
    model = fitted_model(key, fitted)
    if not way:
        return model
    if (way, model.key) in REFUSED:
        pytest.skip(f"{model.key} has no {way} inverse")
    return inverse(model, way, **(LEARNED if way == "learned" else {}))


def signal(model: Model, n: int) -> Array:
    lo, hi = model.provenance.get("span_u", (-1.0, 1.0))
    return ((lo + hi) / 2 + (hi - lo) / 2 * signals.nested_reversals(12, 5, step=0.02))[:n, None]


def valid(fmu: Path, fmi: int) -> None:
    etree = pytest.importorskip("lxml.etree")
    pytest.importorskip("fmu_manipulation_toolbox")  # `hystfmu validate` runs its check if it is installed
    with zipfile.ZipFile(fmu) as archive:
        for name, schema in FILES[fmi].items():
            etree.XMLSchema(file=str(SCHEMAS / schema)).assertValid(etree.fromstring(archive.read(name)))
    assert hy.validate(fmu, 120) == []


def co_simulation(model: Model, fmu: Path, fmi: int, folder: Path) -> None:
    """Require the same bits in fmpy, in a container and, for FMI 2.0, in libcosim with its own clock."""
    u = signal(model, 200)
    y = model.graph.executor().run(u, model.graph.n_outputs, H)
    assert np.ptp(y) > 0
    assert run_by_fmpy(fmu, folder / "plain", u, H).tobytes() == y.tobytes()
    assert run_in_container(fmu, folder / "box", u, H).tobytes() == y.tobytes()
    if fmi == 2:
        got = run_by_libcosim(model.graph, fmu, u)
        assert got.tobytes() == run_by_unit(model.graph, u, times=clock(len(u))).tobytes()


def every_importer(model: Model, fmi: int, folder: Path) -> None:
    fmu = export_fmu(model, folder / "m.fmu", fmi, "m", source=True)  # type: ignore[arg-type]
    valid(fmu, fmi)
    co_simulation(model, fmu, fmi, folder)


@pytest.mark.turn("FMUs in importers")
@pytest.mark.some(1)
@pytest.mark.parametrize(("key", "way", "fmi"), [*SLICE, *LONG])
def test_every_importer(key: str, way: str, fmi: int, fitted: dict[str, Model], tmp_path: Path) -> None:
    every_importer(model_of(key, way, fitted), fmi, tmp_path)


# ---- CVode -----------------------------------------------------------------------------------------------------------
ROWS, TOLERANCES = 150, (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
DYNAMIC = ("actuator", "bouc_wen_oscillator", "g0_bouc_wen", "g0_prandtl_ishlinskii")


def ends(model: Model, fmi: int, tolerance: float, folder: Path) -> None:
    u = signal_for(model)[:ROWS]
    t = np.arange(ROWS) * H
    y, late = model.predict(u), model.predict(np.concatenate([u[:1], u[:-1]]))
    result = simulate_fmu(
        str(export_fmu(model, folder / "m.fmu", fmi)),  # type: ignore[arg-type]
        fmi_type="ModelExchange",
        solver="CVode",
        input=np.array(list(zip(t, u, strict=True)), dtype=[("time", "f8"), ("u", "f8")]),
        output_interval=H,
        stop_time=t[-1],
        relative_tolerance=tolerance,
        record_events=False,
        output=["y"],
    )
    assert np.abs(result["time"] - t).max() < 1e-12
    error = np.abs(result["y"] - y).max()
    if model.graph.continuous_states:
        assert error <= 1.05 * np.abs(late - y).max()
    else:
        assert error == 0.0


@pytest.mark.turn("FMUs in importers")
@pytest.mark.some(1)
@pytest.mark.parametrize("tolerance", [1e-4, 1e-9])
@pytest.mark.parametrize("key", DYNAMIC)
def test_kinds_with_dynamics_end(key: str, tolerance: float, fitted: dict[str, Model], tmp_path: Path) -> None:
    ends(fitted_model(key, fitted), 2, tolerance, tmp_path)


@pytest.mark.stress
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("key", list(METHODS))
def test_every_kind_ends(key: str, fmi: int, fitted: dict[str, Model], tmp_path: Path) -> None:
    for tolerance in TOLERANCES:
        ends(fitted_model(key, fitted), fmi, tolerance, tmp_path)


# ---- libcosim --------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    "name", ["prandtl_ishlinskii", "adaptive_inverse", "bouc_wen", "transfer_function", "mlp", "loop"]
)
def test_same_bits_in_libcosim(name: str, tmp_path: Path) -> None:
    pytest.importorskip("libcosimpy.CosimExecution")
    graph = loop() if name == "loop" else single(name)
    u = rows(graph, 200)
    got = run_by_libcosim(graph, export_fmu(graph, tmp_path / "m.fmu", 2), u)
    want = run_by_unit(graph, u, times=clock(len(u)))
    assert np.ptp(want, axis=0).max() > 1e-3
    assert got.tobytes() == want.tobytes()


# ---- Other readers of SSP archives meet the reference inside: shipped scenarios, papers' loops, a foreign FMU
SCENARIOS = Path(__file__).parents[3] / "scenarios"
SHIPPED = sorted(f.parent.relative_to(SCENARIOS).as_posix() for f in SCENARIOS.rglob("scenario.toml"))
FEW = ("pid", "adaptive", "papers/zhao_tan_2008", "papers/yu_alici_2005_smc", "example_tube")
BOUND = 1e-9  # of the span
NO_ARCHIVE = {
    "example_hold": "has substeps or a hold",
    "example_substeps": "has substeps or a hold",
    "papers/ipmc_bfbnn_learning": "must run in every step",
}


@pytest.mark.turn("FMUs in importers")
@pytest.mark.some(2)
@pytest.mark.parametrize("name", [pytest.param(n, marks=[] if n in FEW else pytest.mark.stress, id=n) for n in SHIPPED])
def test_a_shipped_scenario(name: str, tmp_path: Path) -> None:
    case = Cases(SCENARIOS / name).cases[0]
    if name in NO_ARCHIVE:
        with pytest.raises(InputError, match=NO_ARCHIVE[name]):
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


@pytest.mark.stress
@pytest.mark.parametrize("separate", [False, True])
@pytest.mark.parametrize("name", ["Feedthrough", "Dahlquist"])
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


@pytest.mark.stress
def test_a_loop_with_a_foreign_fmu(tmp_path: Path) -> None:
    plays = Node("plays", "backlash_sum", {}, {"w0": 0.3, "r": [0.1, 0.2, 0.3], "w": [0.3, 0.2, 0.1]})
    fmu = export_fmu(Graph.single(plays), tmp_path / "plays.fmu")
    connections = {"pid.y_d": "reference.r", "fmu.u": "pid.u", "lag.u": "fmu.y"}
    case = Cases(loop_with(fmu, connections, tmp_path)).cases[0]
    written = write_ssp(case, tmp_path / "loop.ssp")
    assert written.components == 3
    for reader in installed(READERS):
        assert error(written.path, reader, case.step) < BOUND, reader


def test_the_page_of_importers_has_a_row_for_each_kind_and_loop() -> None:
    _, kinds, loops, _ = PAGE.read_text("utf-8").split("\n## ")
    folder = shipped_scenarios()
    names = sorted(file.parent.relative_to(folder).as_posix() for file in folder.rglob("scenario.toml"))
    for table, rows_of_it in ((kinds, KEYS), (loops, names)):
        assert re.findall(r"^\| (\S.*?) \|", table, re.MULTILINE)[1:] == rows_of_it, "run 'make importers'"
