"""A run in chunks of rows: the same bits however it is divided, the memory of one chunk whatever its length."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from engines import ready

import hystfmu as hy
from hystfmu.data.columns import csv_text
from hystfmu.scenario import Cases, Run, build, simulate
from hystfmu.scenario.engine.simulation import chunks
from hystfmu.scenario.outcome.metrics import Measure, measure
from hystfmu.scenario.outcome.trace import Picture, Trace
from hystfmu.scenario.ssp.read import read_ssp, run_ssp
from hystfmu.scenario.ssp.write import REFERENCE, write_ssp
from hystfmu.scenario.system.spec import MetricSpec

KINDS = (
    "rms_percent",
    "max_percent",
    "between_samples_percent",
    "variation_ratio",
    "loop_area_percent",
    "rms",
    "peak",
    "final",
)
Divide = Callable[[int], None]


@pytest.fixture
def divide(monkeypatch: pytest.MonkeyPatch) -> Divide:
    """Make chunks of as many rows; a power of two."""

    def smaller(rows: int) -> None:
        monkeypatch.setattr("hystfmu.scenario.system.system.CHUNK_VALUES", 0)
        monkeypatch.setattr("hystfmu.scenario.system.system.SHORTEST_CHUNK", rows)

    return smaller


def rich(loop: dict[str, Any]) -> dict[str, Any]:
    """Several rates, lines between samples, events between steps, final states, all metrics."""
    loop |= {"ripple": 5, "final_states": True, "order": ["plant", "reference", "slow", "pid"]}
    loop["units"]["plant"] |= {"fine": True, "substeps": 2}
    loop["units"]["reference"] |= {
        "values": {"shape": "triangle", "amplitude": 1.0, "frequency": 53.0},
        "fine": True,
    }
    loop["units"]["slow"] = {"block": "sum", "dims": {"n": 1}, "values": {"k": [0.1]}, "every": 3, "hold": "first"}
    loop["units"]["pid"]["inputs"] = {}
    loop["connections"] |= {"slow.u": "reference.r", "pid.u_ff": "slow.y"}
    both = {"signal": "plant.y", "against": "reference.r", "after": 0.00333}
    loop["metrics"] = {kind: {"kind": kind, **both} for kind in KINDS}
    return loop


def test_a_long_case_tells_how_far_it_is(loop: Any, write: Any, divide: Divide, tmp_path: Path) -> None:
    divide(64)
    system = ready(write(loop))
    rows = system.n_steps + 1
    parts = [min(k, rows) / rows for k in range(64, rows + 64, 64)]
    seen: list[float] = []
    hy.run([write(loop)], engine="native", progress=seen.append)
    assert len(parts) > 2
    assert seen == pytest.approx(parts)
    archive = tmp_path / "loop.ssp"
    write_ssp(system.case, archive)
    seen.clear()
    run_ssp(archive, "native", progress=seen.append)
    assert seen == pytest.approx(parts)


@pytest.mark.parametrize("engine", ["fmpy", "native"])
@pytest.mark.parametrize("scheme", ["gauss_seidel", "jacobi", "iterative"])
def test_division_changes_no_bit(loop: Any, write: Any, divide: Divide, engine: Any, scheme: str) -> None:
    rich(loop)["coupling"] = {"scheme": scheme}
    if scheme == "iterative":
        del loop["units"]["slow"]["hold"]
    system = ready(write(loop))
    whole = simulate(system, engine)
    assert len(list(chunks(system, Run(engine)))) == 1
    divide(64)
    pieces = list(chunks(system, Run(engine)))
    assert [p.first for p in pieces] == list(range(0, system.n_steps + 1, 64))
    assert np.concatenate([p.t for p in pieces]).tobytes() == whole.t.tobytes()
    assert np.concatenate([p.values for p in pieces]).tobytes() == whole.values.tobytes()
    assert (pieces[-1].final_states, pieces[0].final_states) == (whole.final_states, {})
    assert simulate(system, engine).values.tobytes() == whole.values.tobytes()


def test_times_are_those_of_whole_steps(loop: Any, write: Any) -> None:
    """n h by samples, not by adding up: at a late row no different from python's own arithmetic."""
    loop |= {"ripple": 7, "step": 1e-4, "stop": 200.0}
    system = ready(write(loop))
    for first in (0, 5, 7, 13_999_985):
        got = system.times(first, first + 11).tolist()
        assert got == [(n // 7) * 1e-4 + (n % 7) * (1e-4 / 7) for n in range(first, first + 11)]
    rows = np.array([0, 1, 12_345_678, system.n_steps])
    t = system.at(rows)
    assert system.rows(t).tolist() == rows.tolist()
    assert system.rows(np.nextafter(t, 0)[1:]).tolist() == rows[1:].tolist()
    assert system.rows(np.nextafter(t, 1e9)[:-1]).tolist() == (rows[:-1] + 1).tolist()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ripple", [1, 10])
def test_metrics_do_not_see_the_division(kind: str, ripple: int) -> None:
    rng = np.random.default_rng(1)
    t, values = 1e-3 * np.arange(1001), rng.normal(size=(1001, 2))
    m = MetricSpec.model_validate({"kind": kind, "signal": "a.y", "against": "b.y", "after": 0.0173})
    columns = {"a.y": 0, "b.y": 1}
    whole = measure(m, Trace(t, values, columns, ripple))
    for _ in range(20):
        found, edges = Measure(m), np.unique(rng.integers(1, 1001, size=rng.integers(1, 40)))
        for a, b in zip([0, *edges], [*edges, 1001], strict=True):
            found.add(Trace(t[a:b], values[a:b], columns, ripple, first=int(a)))
        assert found.value() == whole
    # and by numpy, all rows at once
    at, e = np.arange(18, 1001), (values[:, 0] - values[:, 1])[18:]
    sample = at % ripple == 0
    x, y = values[18:, 1], values[18:, 0]
    percent = 100 / np.ptp(x)
    want = {
        "rms_percent": percent * np.sqrt(np.mean(e**2)),
        "max_percent": percent * np.abs(e).max(),
        "between_samples_percent": percent * np.abs(e - np.interp(at, at[sample], e[sample])).max(),
        "variation_ratio": np.abs(np.diff(y[sample])).sum() / np.abs(np.diff(x[sample])).sum(),
        "loop_area_percent": 50 * abs(np.trapezoid(y, x) * 2 - (x[-1] - x[0]) * (y[-1] + y[0])) / np.ptp(x) / np.ptp(y),
        "rms": np.sqrt(np.mean(e**2)),
        "peak": np.abs(y).max(),
        "final": abs(e[-1]),
    }
    assert whole == pytest.approx(want[kind], rel=1e-12)


def test_verdicts_and_baselines_do_not_see_the_division(loop: Any, write: Any, divide: Divide) -> None:
    folder = write(rich(loop) | {"tube": {"time": 1e-3, "value": 1e-6}})
    for engine in ("native", "fmpy"):
        (first,) = hy.run([folder], engine=engine, record=True)
        stored = [(folder / f"baseline.{kind}").read_bytes() for kind in ("toml", "csv")]
        divide(32)
        (again,) = hy.run([folder], engine=engine)
        assert again.passed, again.lines
        assert again.trace.values.tobytes() == first.trace.values.tobytes()
        hy.run([folder], engine=engine, record=True)
        assert [(folder / f"baseline.{kind}").read_bytes() for kind in ("toml", "csv")] == stored


def test_a_picture_of_a_long_run_shows_its_extremes(
    loop: Any, write: Any, divide: Divide, monkeypatch: pytest.MonkeyPatch
) -> None:
    rich(loop)
    loop["metrics"] = {"max_percent": loop["metrics"]["max_percent"]}
    system = ready(write(loop))
    monkeypatch.setattr("hystfmu.scenario.outcome.trace.MOST_ROWS", 200)
    divide(128)
    picture = Picture(system)
    for chunk in chunks(system, Run("native")):
        picture.add(chunk)
    kept, whole = picture.trace(), simulate(system, "native")
    assert len(kept.t) <= 200 < len(whole.t)
    assert (np.diff(kept.t) > 0).all()
    assert kept.t[[0, -1]].tolist() == whole.t[[0, -1]].tolist()
    error, all_errors = (x["plant.y"] - x["reference.r"] for x in (kept, whole))
    assert (error.min(), error.max()) == (all_errors.min(), all_errors.max())


def test_an_ssp_is_written_as_it_runs(loop: Any, write: Any, tmp_path: Path, divide: Divide) -> None:
    archive, out = tmp_path / "loop.ssp", tmp_path / "loop.csv"
    write_ssp(Cases(write(loop)).cases[0], archive, separate=True)
    whole = simulate(build(read_ssp(archive).case), "native")
    divide(64)
    told = run_ssp(archive, "native", out=out)
    assert told.passed
    assert told.lines() == [f"{archive}: 301 rows of {len(whole.columns)} outputs; 2 signals agree with {REFERENCE}"]
    columns = {"t": whole.t} | {end: whole[end] for end in whole.columns}
    assert out.read_text() == csv_text(columns)


MEMORY = """
import resource, sys
from hystfmu.cli import main
from hystfmu.scenario import Run
path, stop, out = sys.argv[1:]
if path.endswith(".ssp"):
    try:
        main(["simulate", path, "--engine", "native", "--stop", stop, "-o", out + "/rows.csv"])
    except SystemExit as e:
        assert e.code == 0
else:
    hy.run([path], engine="native", report=out)
# of itself not ru_maxrss: that begins with the memory of the process that started it
(own,) = (line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM"))
print(max(int(own), resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss))
"""


def peak(path: Path, stop: float, out: Path) -> float:
    """Largest memory of a process that makes a run, or of its child (MB)."""
    words = [sys.executable, "-c", MEMORY, str(path), str(stop), str(out)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return int(done.stdout.split()[-1]) / 1024


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize(
    ("kind", "most"), [("scenario", 1_000_000), pytest.param("ssp", 250_000, marks=pytest.mark.stress)]
)
def test_memory_does_not_grow_with_the_number_of_steps(
    loop: Any, write: Any, tmp_path: Path, kind: str, most: int
) -> None:
    """All values of the longer run would take 30 MB and 12 MB more."""
    used = []
    (tmp_path / "out").mkdir()
    for n in (50_000, most):
        folder = write(loop | {"stop": n * 1e-4 if kind == "scenario" else 0.03})
        path = folder if kind == "scenario" else write_ssp(Cases(folder).cases[0], tmp_path / "loop.ssp").path
        used.append(peak(path, n * 1e-4, tmp_path / "out"))
    assert used[1] - used[0] < 4, used
    if kind == "ssp":
        assert (tmp_path / "out" / "rows.csv").read_bytes().count(b"\n") == most + 2
