"""FMUs that learn, in fmpy, saved and restored mid-way: recursive least squares on the IPMC record, within 1.2 of batch
least squares; an adaptive inverse while it follows a sudden change of its plant."""

from pathlib import Path

import numpy as np
import pytest
from fmu_master import Array, unpack
from fmu_slave import Slave

from hystfmu import Dataset, Graph, Node
from hystfmu.fmu import export_fmu
from hystfmu.identify.methods.polynomial_narx import basis, lagged
from hystfmu.identify.solvers.ridge import least_squares
from hystfmu.model import Model
from papers import ipmc_sensor

H, RIDGE, LAGS = 1e-3, 1e-3, 3


def regression(record: Dataset) -> tuple[Array, Array]:
    """Monomials of lags of the displacement and of the Zhao-Tan operator of it; voltage."""
    x = record.u / ipmc_sensor.STROKE
    operator = Graph.single(Node("f", "zhao_tan")).run(x)
    return basis(np.column_stack([lagged(x, LAGS), lagged(operator, LAGS)]), 2), record.y


def run(slave: Slave, u: Array, first: int) -> Array:
    """Run rows first, first + 1, ...; row 0 ends the initialisation."""
    rows = enumerate(u.tolist(), start=first)
    return np.array([slave.step((k - 1) * H, H, row) if k else slave.start(row) for k, row in rows])


LONG = [pytest.param(60, f, v, marks=pytest.mark.stress) for f in ("plain", "corrected") for v in (2, 3)]


def goes_on_where_it_was_saved(folder: Path, u: np.ndarray, native: np.ndarray) -> None:
    """The FMU has the bits of the native run, and another instance those of its second half after a restore."""
    half = len(u) // 2
    straight, other = Slave(folder), Slave(folder)
    first = run(straight, u[:half], 0)
    saved = straight.save()
    second = run(straight, u[half:], half)
    assert np.concatenate([first, second]).tobytes() == native.tobytes()
    run(other, u[:1], 0)
    other.restore(saved)
    assert run(other, u[half:], half).tobytes() == second.tobytes()


@pytest.mark.some(0.25)
@pytest.mark.parametrize(("reversals", "form", "fmi"), [(30, "plain", 2), (30, "corrected", 3), *LONG])
def test_an_fmu_learns_as_well_as_batch_and_survives_being_saved(
    reversals: int, form: str, fmi: int, tmp_path: Path
) -> None:
    phi, voltage = regression(ipmc_sensor.ipmc(reversals, rest=1.0, seed=3))
    held, truth = regression(ipmc_sensor.ipmc(30, (1.5, 3.0, 4.0), noise=0.0, seed=4))
    batch, _ = least_squares(phi, voltage, RIDGE)
    values = {"form": form, "mu": 1.0, "eta": 1 / (len(phi) * RIDGE**2)}
    if form == "corrected":  # chosen on another record, see tests/blocks/test_adaptive_inverse.py
        values |= {"r": 2 * float(np.std(voltage - phi @ batch)), "share": 0.1}
    n, u = phi.shape[1], np.column_stack([phi, voltage])
    graph = Graph.single(Node("learner", "recursive_least_squares", {"n": n}, values)).with_step(H)
    native = graph.run(u, H)
    folder = unpack(export_fmu(graph, tmp_path / f"{fmi}.fmu", fmi), tmp_path / f"{fmi}")  # type: ignore[arg-type]
    goes_on_where_it_was_saved(folder, u, native)
    theta = native[-1, 1:-1]
    ratio = float(np.linalg.norm(held @ theta - truth) / np.linalg.norm(held @ batch - truth))
    print(f"{form}: {ratio:.3f} of batch")
    assert ratio <= 1.2


@pytest.mark.parametrize("fmi", [2, 3])
def test_an_adaptive_inverse_survives_being_saved_while_it_learns(fmi: int, tmp_path: Path) -> None:
    """Wanted output, reference and a plant whose gain falls by 20 % at a third; saved at a half."""
    model = Model.load(Path(__file__).parents[2] / "scenarios" / "models" / "backlash_adaptive_inverse.model.toml")
    t, rng = np.arange(900) * H, np.random.default_rng(1)
    v = np.minimum(t / 0.02, 1) * np.sin(2 * np.pi * 10 * t)
    late = np.minimum(t / 0.02, 1) * np.sin(2 * np.pi * 10 * (t - 2.4e-3))
    u = np.column_stack([v, v, np.where(t < 0.3, 1.0, 0.8) * late + 1e-4 * rng.normal(size=len(t))])
    graph = model.graph.with_step(H)
    native, half = graph.run(u, H), len(u) // 2
    names = [f"{p.name}_{i}" for p in graph.ports if p.kind == "output" for i in range(p.size)]
    theta = native[:, [n.startswith("theta") for n in names]]
    assert np.ptp(theta[half:], axis=0).max() > 1e-3, "it learns after it was saved"
    folder = unpack(export_fmu(graph, tmp_path / f"{fmi}.fmu", fmi), tmp_path / f"{fmi}")  # type: ignore[arg-type]
    goes_on_where_it_was_saved(folder, u, native)
