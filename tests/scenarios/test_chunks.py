"""A run in chunks of rows has the same bits however it is divided; every metric against its definition."""

import itertools
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from engines import ready

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.data.columns import csv_text
from hystfmu.scenario import Cases, Run, build, simulate
from hystfmu.scenario.engine.simulation import chunks
from hystfmu.scenario.outcome import trace
from hystfmu.scenario.outcome.metrics import Measure, measure
from hystfmu.scenario.outcome.trace import Picture, Sweeps, Trace
from hystfmu.scenario.ssp.read import read_ssp, run_ssp
from hystfmu.scenario.ssp.write import REFERENCE, write_ssp
from hystfmu.scenario.system.spec import MetricSpec

KINDS = (
    "rms_percent", "max_percent", "between_samples_percent", "variation_ratio", "loop_area_percent", "rms", "peak",
    "final",
)  # fmt: skip
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
    loop["units"]["reference"] |= {"values": {"shape": "triangle", "amplitude": 1.0, "frequency": 53.0}, "fine": True}
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


@pytest.mark.some(2)
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


@pytest.mark.turn("systems of an SSP")
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
import hystfmu as hy
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


@pytest.mark.some(0.5)
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize(
    ("kind", "most"), [("scenario", 500_000), pytest.param("ssp", 250_000, marks=pytest.mark.stress)]
)
def test_memory_does_not_grow_with_the_number_of_steps(
    loop: Any, write: Any, tmp_path: Path, kind: str, most: int
) -> None:
    """All values of the longer run would take 14 MB and 12 MB more."""
    used = []
    for n in (50_000, most):
        out = tmp_path / f"out {n}"
        out.mkdir()  # of its own: a file of other content is not replaced
        folder = write(loop | {"stop": n * 1e-4 if kind == "scenario" else 0.03})
        path = folder if kind == "scenario" else write_ssp(Cases(folder).cases[0], tmp_path / "loop.ssp").path
        used.append(peak(path, n * 1e-4, out))
    assert used[1] - used[0] < 4, used
    if kind == "ssp":
        assert (out / "rows.csv").read_bytes().count(b"\n") == most + 2


# ---- traces ----------------------------------------------------------------------------------------------------------
ENDS = {"a.y": 0, "b.y": 1, "c.y": 2}


def drawn_run(n: int, seed: int = 1) -> Trace:
    return Trace(0.5 * np.arange(n), np.random.default_rng(seed).normal(size=(n, 3)), ENDS, 1)


def divided(whole: Trace, *edges: int) -> list[Trace]:
    pieces = []
    for a, b in zip([0, *edges], [*edges, len(whole.t)], strict=True):
        last = {"a": "0"} if b == len(whole.t) else {}
        pieces.append(Trace(whole.t[a:b], whole.values[a:b], ENDS, 1, last, a, Sweeps(2 * (b - a), b - a, b - a)))
    return pieces


def spec(kind: str, signal: str = "a.y", against: str | None = "b.y") -> MetricSpec:
    return MetricSpec.model_validate({"kind": kind, "signal": signal} | ({"against": against} if against else {}))


# ---- a run in one piece ---------------------------------------------------------------------------------------------


def test_a_trace_that_is_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trace, "MOST_VALUES", 30)
    assert len(Trace.joined(divided(drawn_run(10), 5), 10).t) == 10
    with pytest.raises(InputError, match=r"^a trace would contain 11 rows of 3 values, more than 30: use its chunks$"):
        Trace.joined(divided(drawn_run(11), 5), 11)


# ---- metrics by their definitions ------------------------------------------------------------------------------------
H, RIPPLE, N = 0.25, 3, 31
RNG = np.random.default_rng(np.random.SeedSequence().entropy)
SEED = int(RNG.integers(2**31))


def metric(kind: str, **more: Any) -> MetricSpec:
    return MetricSpec.model_validate({"kind": kind, "signal": "a.y", "against": "b.y", **more})


def rows_of(signal: Any, against: Any, first: int = 0, ripple: int = RIPPLE) -> Trace:
    t = H * np.arange(first, first + len(signal))
    return Trace(t, np.column_stack([signal, against]), {"a.y": 0, "b.y": 1}, ripple, {}, first)


def chunked(m: MetricSpec, whole: Trace, length: int) -> float:
    found = Measure(m)
    for k in range(0, len(whole.t), length):
        rows = slice(k, k + length)
        found.add(rows_of(whole["a.y"][rows], whole["b.y"][rows], k, whole.ripple))
    return found.value()


def between(y: list[float], r: list[float], first: int) -> float:
    """Largest distance of the error from the straight line between two samples."""
    e, largest = [a - b for a, b in zip(y, r, strict=True)], 0.0
    for k in range(first, len(e)):
        left, right = k // RIPPLE * RIPPLE, -(-k // RIPPLE) * RIPPLE
        if left < first:  # the window does not contain the line
            continue
        share = (k - left) / RIPPLE
        largest = max(largest, abs(e[k] - e[left] - share * (e[min(right, len(e) - 1)] - e[left])))
    return largest


def variation(y: list[float], r: list[float], first: int) -> float:
    at = [k for k in range(len(y)) if k % RIPPLE == 0 and k >= first]
    moved = [sum(abs(x[b] - x[a]) for a, b in itertools.pairwise(at)) for x in (y, r)]
    return moved[0] / moved[1]


def area(y: list[float], r: list[float], first: int) -> float:
    """Shoelace formula over the polygon of the window, closed by its last side; of the rectangle of the spans."""
    x, z = r[first:], y[first:]
    twice = sum(x[k - 1] * z[k] - x[k] * z[k - 1] for k in range(len(x)))
    return 100 * abs(twice) / 2 / ((max(x) - min(x)) * (max(z) - min(z)))


DEFINITIONS: dict[str, Callable[[list[float], list[float], int], float]] = {
    "rms": lambda y, r, f: math.sqrt(sum((a - b) ** 2 for a, b in zip(y[f:], r[f:], strict=True)) / (len(y) - f)),
    "rms_percent": lambda y, r, f: 100 * DEFINITIONS["rms"](y, r, f) / (max(r[f:]) - min(r[f:])),
    "max_percent": lambda y, r, f: (
        100 * max(abs(a - b) for a, b in zip(y[f:], r[f:], strict=True)) / (max(r[f:]) - min(r[f:]))
    ),
    "between_samples_percent": lambda y, r, f: 100 * between(y, r, f) / (max(r[f:]) - min(r[f:])),
    "variation_ratio": variation,
    "peak": lambda y, r, f: max(abs(v) for v in y[f:]),
    "final": lambda y, r, f: abs(y[-1] - r[-1]),
    "loop_area_percent": area,
}


@pytest.mark.parametrize("kind", list(DEFINITIONS))
@pytest.mark.parametrize("skip", [0, 6, 7])
def test_a_metric_is_its_definition(kind: str, skip: int) -> None:
    rng = np.random.default_rng(SEED)
    y, r = (rng.normal(size=N) for _ in range(2))
    y[7] += 100.0  # between two samples; a window that begins there does not contain the first one
    m = metric(kind, after=skip * H)
    want = DEFINITIONS[kind](y.tolist(), r.tolist(), skip)
    whole = rows_of(y, r)
    assert measure(m, whole) == pytest.approx(want, rel=1e-12), SEED
    for length in (1, 2, 4, 9, 30):
        assert chunked(m, whole, length) == pytest.approx(want, rel=1e-12), (SEED, length)
    lower = measure(m, rows_of(-y, -r))  # mirrored: lowest and highest change places
    assert lower == pytest.approx(want, rel=1e-12)


def test_a_stroke_of_zero_is_refused_and_a_given_one_is_taken() -> None:
    rests = rows_of([1.0, 2.0], [3.0, 3.0])
    with pytest.raises(InputError, match=r"^the stroke is zero: b\.y is constant; state 'stroke'$"):
        measure(metric("max_percent"), rests)
    assert measure(metric("max_percent", stroke=4.0), rests) == 50.0
    assert measure(metric("rms"), rests) == math.sqrt(2.5)


@pytest.mark.parametrize("kind", ["rms_percent", "max_percent"])
def test_lines_leave_out_the_turn_arounds(kind: str) -> None:
    """A scan whose error is 0.3 on the lines and 5 in the turn-arounds; in one piece and in chunks of seven rows."""
    down = np.arange(40.0, 0, -1)
    turn = 40 + np.array([0.8, 1.2, 1.2, 0.8])
    scan = np.concatenate([np.arange(0, 41.0), turn, down])
    bent = np.abs(np.diff(scan, 2)) > 0.01
    on = ~np.concatenate([[True, True], bent])  # two steps tell whether a row is on a line
    whole = rows_of(scan + np.where(on, 0.3, 5.0), scan)
    assert measure(metric(kind, lines=True, stroke=100.0), whole) == pytest.approx(0.3)
    assert measure(metric(kind, stroke=100.0), whole) > 0.5
    m = metric(kind, lines=True, stroke=100.0)
    assert chunked(m, whole, 7) == measure(m, whole)
    bow = np.linspace(0, 60, 1000) ** 2
    assert measure(metric("rms_percent", lines=True, stroke=1.0), rows_of(bow, bow)) == np.inf
    with pytest.raises(ValueError, match="'lines' belongs to"):
        metric("variation_ratio", lines=True)
