"""Every key of METHODS and each of its inverses, as FMI 2.0 and FMI 3.0 FMU, in every importer available."""

import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy import simulate_fmu
from fmu_events import Events, Solver, adaptive, euler
from fmu_master import Array, loop, rows, single
from runners import clock, exchange_by_fmpy, run_by_fmpy, run_by_libcosim, run_by_unit, run_in_container
from test_keys import LEARNED, REFUSED, H, fitted_model, ramps, signal_for

import hystfmu as hy
from hystfmu import Model
from hystfmu.data import signals
from hystfmu.fmu import export_fmu
from hystfmu.identify import METHODS
from hystfmu.inverse import METHODS as WAYS
from hystfmu.inverse import inverse

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
CASES = [(key, way, fmi) for key in METHODS for way in ("", *WAYS) for fmi in (2, 3)]
LONG = [pytest.param(*c, marks=pytest.mark.stress) for c in CASES if c not in SLICE]
FREE = 2e-2  # of the range: a solver against Newmark's method with steps of a period / 50


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


def model_exchange(model: Model, fmu: Path, fmi: int, folder: Path) -> None:
    """Require the bits of Co-Simulation without continuous states, else the order of Euler and the adaptive result."""
    graph, u = model.graph, signal(model, 100)
    want = graph.executor().run(u, graph.n_outputs, H)
    moves = np.ptp(want)
    unit = Events(graph, folder / "me", fmi, interface="me")

    def run(solver: Solver, u: Array) -> Array:
        assert unit.call("Reset") == 0
        return unit.integrate(u, H, solver, "ramp" if ramps(graph) else "end")

    if not graph.continuous_states:
        for got in (run(euler(1), u), exchange_by_fmpy(fmu, graph, u, "Euler", H)):
            assert got.tobytes() == want.tobytes()
        unit.free()
        return
    assert np.abs(run(adaptive, u) - want).max() <= (FREE if ramps(graph) else 1e-9) * moves
    exact = run(adaptive, u[:10])
    coarse, fine = (np.abs(run(euler(n), u[:10]) - exact).max() for n in (256, 512))
    assert np.log2(coarse / fine) == pytest.approx(1, abs=0.2), (coarse, fine)
    unit.free()
    held = np.full_like(u, u.max())  # fmpy changes inputs only between the steps of CVode
    got = exchange_by_fmpy(fmu, graph, held, "CVode", H)
    want = graph.executor().run(held, graph.n_outputs, H)
    settles = np.ptp(want) if np.ptp(want) > 1e-9 * moves else moves  # a model in equilibrium moves by rounding
    assert np.abs(got - want).max() <= (FREE if ramps(graph) else 1e-5) * settles


def every_importer(model: Model, fmi: int, folder: Path) -> None:
    fmu = export_fmu(model, folder / "m.fmu", fmi, "m", source=True)  # type: ignore[arg-type]
    valid(fmu, fmi)
    co_simulation(model, fmu, fmi, folder)
    model_exchange(model, fmu, fmi, folder)


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
