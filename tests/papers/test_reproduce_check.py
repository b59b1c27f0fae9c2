"""`hystfmu reproduce`: what is missing is told before anything runs; the rest runs, and the exit status is 1."""

import json
import re
import sys
import tomllib
from pathlib import Path

import numpy as np
import plants
import pytest
import reasons
from click.testing import CliRunner

from hystfmu import Dataset, signals
from hystfmu.cli import main
from papers import drawn_plants, fresh_plants, loops, reproduce, yu_alici_2005_smc
from papers.loops import ASKED, ASKED_PERIODIC, CORNERS, Structure
from papers.table import Report, figure


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names that were computed, which stubs do in no time."""
    names: list[str] = []

    def stub(name: str) -> object:
        return lambda *_: (names.append(name), Report(name, "stub", (), ()))[1]

    for name in ("dbo_piezo", "boucwen_benchmark", "loops"):
        monkeypatch.setattr(f"papers.{name}.table", stub(name))
    return names


def test_a_folder_without_one_set_runs_the_others(tmp_path: Path, ran: list[str]) -> None:
    done = CliRunner().invoke(main, ["reproduce", "loops", "dbo_piezo", "--data", str(tmp_path), "--json"])
    assert (done.exit_code, ran) == (1, ["loops"])
    (line,) = done.stderr.splitlines()
    assert line == f"skipped dbo_piezo: {tmp_path}: The folder must hold dbo_piezo/Test_Vi_Do_Di.dat or " + (
        "Test_Vi_Do_Di.dat. Got neither."
    )
    assert [r["name"] for r in json.loads(done.stdout)] == ["loops"]


def test_nothing_to_run_is_one_line_and_exit_status_2(tmp_path: Path, ran: list[str]) -> None:
    for names in (["dbo_piezo"], ["boucwen_benchmark"]):
        done = CliRunner().invoke(main, ["reproduce", *names, "--data", str(tmp_path)])
        assert (done.exit_code, len(done.stderr.splitlines()), ran) == (2, 1, [])
    done = CliRunner().invoke(main, ["reproduce", "loops", "no_such_paper"])
    assert (done.exit_code, len(done.stderr.splitlines()), ran) == (2, 1, [])


def test_a_missing_package_is_told_first(ran: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    done = CliRunner().invoke(main, ["reproduce", "boucwen_benchmark", "loops"])
    assert (done.exit_code, ran) == (1, ["boucwen_benchmark"])
    assert done.stderr.startswith("skipped loops: ")
    assert "pip install 'hystfmu[study]'" in done.stderr


def test_a_package_without_papers_says_in_one_line_where_they_are(tmp_path: Path, ran: list[str]) -> None:
    done = CliRunner().invoke(main, ["reproduce", "loops", "--papers", str(tmp_path / "papers")])
    assert (done.exit_code, len(done.stderr.splitlines()), ran) == (2, 1, [])
    assert (
        f"{tmp_path}/papers: The papers must be in a folder scenarios/papers, which only the repository" in done.stderr
    )


# ---- The table of the shipped loops: worst corners and nearest structures by hand, targets as asked, all of them met
SCENARIOS = Path(__file__).parents[2] / "scenarios"


def structure(**changes: float) -> Structure:
    errors = {"sine_10": 0.015, "sine_100": 0.01, "broadband": 0.015}
    for k, corner in enumerate(CORNERS):
        errors |= {f"{corner}_10": 0.01 * k, f"{corner}_100": 0.1 * k, f"{corner}_broadband": 0.02 * k}
    return Structure("made", errors | changes, 4.0, 2.0, 1.0)


def test_the_worst_corner_is_the_largest_of_four() -> None:
    made = structure()
    assert made.worst("10") == pytest.approx(0.03)
    assert made.worst("100", "_two_steps") is None
    assert made.excess(ASKED) == pytest.approx(0.5)  # nominal figures at half of what is asked, corners below
    assert structure(down_600_100=1.5).excess(ASKED) == pytest.approx(2.0)
    assert Structure("short", {"sine_10": 0.0}, 4.0, 2.0, 1.0).excess(ASKED_PERIODIC) == float("inf")


def test_targets_that_are_missed_say_so() -> None:
    rows = loops._targets(structure(down_600_100=1.5), "S18", ASKED)
    assert [r.quantity for r in rows if r.met is False] == ["S18: 100 Hz, worst corner"]


def test_what_is_asked_is_what_the_scenarios_ask() -> None:
    limits = tomllib.loads((SCENARIOS / "loops" / "feedback.toml").read_text())
    for key, (nominal, corner) in ASKED.items():
        case = "broadband" if key == "broadband" else f"sine_{key}"
        assert limits["conditions"][case]["limits"]["tracking"] == nominal
        assert limits["conditions"][f"corner_{key}"]["limits"]["tracking"] == corner
    assert limits["margins"]["Ms_db"] == loops.MS_DB


@pytest.mark.stress
def test_all_targets_but_those_on_time_are_met() -> None:
    report = reproduce("loops")
    assert not [(r.quantity, r.ours) for r in report.rows if r.met is False and r.where != "speed"]
    assert {r.quantity.partition(",")[0].partition(":")[0] for r in report.rows} >= {"S18", "P6"}


# ---- The table of random plants: its plants are what they claim to be, its seeds are said, its targets hold
SEED = int(np.random.SeedSequence().generate_state(1)[0])


@pytest.mark.parametrize("name", ["play_sum", "bent", "stop_like", "butterfly"])
def test_a_plant_is_rate_independent_and_returns_to_its_path(name):
    plant = getattr(drawn_plants, name)(np.random.default_rng(SEED))
    loop = signals.ramps([0, 1, -1, 0.4, -0.2, 0.4, 1], 0.02)
    y = plant(loop)
    first, back = np.flatnonzero(np.abs(loop - 0.4) < 1e-12)[-2:]
    assert y[first] == pytest.approx(y[back], abs=1e-12), SEED  # the minor loop closes
    assert plant(np.repeat(loop, 2))[::2] == pytest.approx(y, abs=1e-12), SEED


def test_bent_plants_increase_and_others_do_not():
    v = np.linspace(-1, 1, 201)
    rise = signals.ramps([0, -1, 1], 0.01)[100:]
    for seed in (SEED, SEED + 1, SEED + 2):
        assert np.diff(drawn_plants.bent(np.random.default_rng(seed))(rise)).min() > -1e-12, seed
    assert np.diff(drawn_plants.butterfly(np.random.default_rng(SEED))(v)).min() < 0


def test_the_plays_are_those_of_the_oracle():
    u = signals.nested_reversals(10, SEED)
    rng = np.random.default_rng(SEED)
    r, w = np.sort(rng.uniform(0.05, 0.6, drawn_plants.PLAYS)), rng.uniform(0.3, 1.7, drawn_plants.PLAYS)
    y = drawn_plants.play_sum(np.random.default_rng(SEED))(u)
    assert y == pytest.approx((3 * u + plants.plays(u, r) @ w) / (3 + (1 - r) @ w), abs=1e-14)


def test_a_row_says_its_seeds_and_meets_its_target():
    (row,) = fresh_plants._odd_rows("butterfly", f"seed {SEED}", (SEED,))
    assert row.met, row
    assert str(SEED) in row.quantity


@pytest.mark.stress
def test_all_targets_hold_on_seeds_drawn_now():
    report = reproduce("fresh_plants")
    assert not [(r.quantity, r.ours) for r in report.rows if r.met is False]
    drawn = {m for r in report.rows for m in re.findall(r"drawn, first (\d+)|, seed (\d+)", r.quantity)}
    assert len(drawn) >= 2


# ---- Yu & Alici 2005: the dynamic Preisach sum against relays in a plain loop, and the whole table
H, STEPS = 1e-3, 4


def relays(u, nodes):
    """Switch every relay of the cells of a grid, from its definition; a cell is one relay at its centre."""
    centres = (nodes[1:] + nodes[:-1]) / 2
    pairs = [(a, b) for i, a in enumerate(centres) for b in centres[: i + 1]]
    state = [1.0 if a + b < 0 else -1.0 for a, b in pairs]  # demagnetised about 0
    out = []
    for v in u:
        state = [1.0 if v > a else -1.0 if v < b else s for (a, b), s in zip(pairs, state, strict=True)]
        out.append(state)
    return np.array(out)


@pytest.mark.parametrize("dynamic", [False, True])
def test_a_density_that_depends_on_the_rate_needs_equation_3(monkeypatch, dynamic):
    monkeypatch.setattr(yu_alici_2005_smc, "STEPS", STEPS)
    monkeypatch.setattr(yu_alici_2005_smc, "THIN", 1)
    rng = np.random.default_rng(0)
    fine = np.linspace(-1, 1, 25)  # several relays in a cell
    density = [rng.uniform(0.5, 1, 24 * 25 // 2), 1e-2 * rng.uniform(0.5, 1, 24 * 25 // 2)]

    def plant(u):
        switched = relays(u, fine)
        return 0.2 + (switched @ density[0] + switched @ density[1] * np.gradient(u, H)) / 300

    t = H * np.arange(3001)
    sweep = (1 - t / 4) * np.sin(2 * np.pi * (2 * t + 6 * t**2))
    record = Dataset.from_signal(sweep, plant(sweep), H)
    model = yu_alici_2005_smc.preisach(record, dynamic)
    error = 100 * np.std(model(sweep) - record.y) / record.span
    assert (error < 2.5) == dynamic, error


def test_the_relay_and_the_plane_are_drawn():
    relay, plane = yu_alici_2005_smc.drawings_of_relays()
    assert [figure(relay), figure(plane)] == ["fig. 4", "fig. 5"]
    u, y = relay.lines[0].x, relay.lines[0].y
    assert set(y[u > yu_alici_2005_smc.ALPHA]) == {1.0}
    assert set(y[u < yu_alici_2005_smc.BETA]) == {-1.0}
    beta, alpha = plane.lines[1].x, plane.lines[1].y
    assert (np.diff(beta) >= 0).all()
    assert (np.diff(alpha) <= 0).all()
    assert ((np.diff(beta) == 0) ^ (np.diff(alpha) == 0)).all(), "a staircase"
    assert {beta[1], alpha[0]} <= set(signals.decaying_sine(3, 0.3, 200))


@pytest.mark.stress
def test_the_whole_table():
    report = reproduce("yu_alici_2005_smc")
    assert [f"{r.quantity}: {r.verdict()}" for r in report.rows if r.met is False] == []
    assert {figure(d) for d in report.drawings} == {f"fig. {n}" for n in range(3, 12)}
    reasons.check(report)
    of = {r.quantity: r for r in report.rows}
    static, dynamic = (of[f"{name}: RMS, %FS, training signal"] for name in ("Preisach sum", "dynamic Preisach sum"))
    assert dynamic.literal < static.literal / 3
