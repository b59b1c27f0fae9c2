"""From one record to a loop: every file is there, the loop holds what is asked, a poor record says what to measure."""

import json
import os
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from invoked import invoked

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.cli import main
from hystfmu.data.synthetic import displacement, piezo
from hystfmu.start.excitation import MOST_ROWS, excitation, write_excitation


def call(*words: object) -> tuple[int, str, str]:
    found = CliRunner().invoke(main, [str(w) for w in words], catch_exceptions=False)
    return found.exit_code, found.stdout, found.stderr


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A German file of a device with return-point memory, and what `start` makes of it."""
    folder = tmp_path_factory.mktemp("start")
    data = hy.synthetic.piezo(60, 1000.0, seed=5)
    lines = ["Zeit [ms];Spannung [V];Weg [µm]", *(f"{1e3 * t:.1f};{u:.6f};{y:.6f}" for t, u, y in _rows(data))]
    (folder / "messung.csv").write_text("\r\n".join(lines).replace(".", ","), encoding="cp1252")
    words = ["--time", "Zeit [ms]", "--model", "prandtl_ishlinskii", "--json"]
    status, out, _ = call("start", folder / "messung.csv", *words, "-o", folder / "my loop")
    (folder / "told.json").write_text(out)
    assert status == 0, out
    return folder


def _rows(data: hy.Dataset) -> list[tuple[float, float, float]]:
    return list(zip(data.t.tolist(), data.u.tolist(), data.y.tolist(), strict=True))


@pytest.mark.turn("start", name="German file")
def test_milliseconds_are_not_seconds(made: Path) -> None:
    told = json.loads((made / "told.json").read_text())
    assert told["verdict"]["approved"]
    assert json.loads((made / "my loop" / "verdict.json").read_text()) == told["verdict"]
    assert hy.Model.load(made / "my loop" / "messung.model.toml").step == pytest.approx(1e-3)


@pytest.mark.turn("start", name="German file")
def test_every_drawn_device_stays_within_its_bound(made: Path) -> None:
    cases = {c["case"]: c for c in json.loads((made / "told.json").read_text())["cases"]}
    asked = {n for n, c in cases.items() if c["asked_percent"]}
    assert {"two_steps", "up", "down"} <= asked
    assert all(float(cases[n]["rms_percent"]) <= float(cases[n]["asked_percent"]) for n in asked)
    assert float(cases["sine"]["rms_percent"]) < 0.5 * float(cases["neither"]["rms_percent"])


@pytest.mark.turn("start", name="German file")
def test_each_artefact_is_there_and_its_command_repeats_it(made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = json.loads((made / "told.json").read_text())["files"]
    assert all(Path(f["path"]).exists() for f in files.values())
    assert not [w for f in files.values() for w in shlex.split(f["command"]) if w.endswith("my")]  # a quoted blank
    monkeypatch.chdir(made)
    before = Path(files["model"]["path"]).read_text()
    again = ("FMU of the model", "inverse", "FMU of the inverse", "FMU of the controller", "model")
    for command in (files[name]["command"] for name in again):
        status, out, err = call(*shlex.split(command)[1:])
        assert status == 0, out + err

    def parameters(text: str) -> str:
        return text.partition("[[blocks]]")[2]

    assert parameters(Path(files["model"]["path"]).read_text()) == parameters(before) != ""
    status, out, _ = call("run", files["loop"]["path"])
    assert status == 0, out
    status, out, _ = call("margins", files["loop"]["path"])
    assert status == 0, out


@pytest.mark.stress
def test_the_study_of_drawn_devices_runs_as_it_is(made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    command = shlex.split(json.loads((made / "told.json").read_text())["files"]["study of random devices"]["command"])
    monkeypatch.chdir(made)
    status, out, err = call(*command[1:], "--json")
    assert status == 0, out + err
    told = json.loads(out)
    assert (told["rows"], told["failed"]) == (200, 0)
    spec = tomllib.loads((made / command[2]).read_text())
    assert {"plant.hysteresis_r"} < set(spec["parameters"])


@pytest.mark.turn("start", name="German file")
def test_the_loop_runs_to_the_same_bits_in_both_engines(made: Path) -> None:
    loop = hy.Scenario.load(made / "my loop" / "loop")
    one, two = (loop.run("nested", engine=e).trace for e in ("native", "fmpy"))
    assert one is not None
    assert two is not None
    assert (one["plant.y"] == two["plant.y"]).all()


@pytest.mark.turn("start")
@pytest.mark.parametrize("drift", [0.0, 0.1])
def test_a_poor_record_says_what_to_measure_next(drift: float, tmp_path: Path) -> None:
    k = np.arange(300)
    u = 50 + 50 * np.exp(-0.002 * k) * np.sin(2 * np.pi * k / 50)
    play = hy.Model("device", hy.blocks.PrandtlIshlinskii(w0=0.5, r=[5.0, 12.0], w=[0.3, 0.2]).graph)
    hy.Dataset(1e-3 * k, u, play.predict(u) * (1 + drift * k / 300)).to_csv(tmp_path / "decay.csv")
    status, out, err = call("start", tmp_path / "decay.csv", "--model", "prandtl_ishlinskii", "-o", tmp_path / "mine")
    assert status == 0, out + err
    assert "not informative enough to identify memory" in err
    assert ("this cannot reduce the error" in err) == (drift > 0)
    page = (tmp_path / "mine" / "report.html").read_text()
    assert "Worst against its limit: " in page
    assert "/neither</b>" not in page, "a case for comparison has no limit"
    found = np.genfromtxt(tmp_path / "mine" / "measure_next.csv", delimiter=",", skip_header=1)
    t, v = found[:, 0], found[:, 1]
    assert np.allclose(np.diff(t), t[1] - t[0])
    assert 1e-3 / (t[1] - t[0]) == pytest.approx(round(1e-3 / (t[1] - t[0]))), "a whole multiple of the rate"
    assert v[0] == v[-1] == pytest.approx(u[0])
    assert u.min() - 1e-9 <= v.min() <= v.max() <= u.max() + 1e-9
    measured = hy.Dataset(t, v, play.predict(v))
    assert not any("informative" in w for w in hy.fit(measured, "prandtl_ishlinskii").fit.get("warnings", ()))


def test_without_an_inverse_the_model_stays(tmp_path: Path) -> None:
    """A butterfly, such as the strain of a magnetostrictive rod over its current: no controller, all the rest."""
    u = np.sin(np.arange(400) / 20)
    hy.Dataset(1e-3 * np.arange(400), u, u**2).to_csv(tmp_path / "folded.csv")
    words = ["start", tmp_path / "folded.csv", "--model", "constraint_factor_mlp", "-o", tmp_path / "mine"]
    status, _, err = call(*words)
    assert status == 1
    (line,) = [line for line in err.splitlines() if line.startswith("no loop: ")]
    assert "not monotone" in line
    made = {path.name for path in (tmp_path / "mine").iterdir()}
    assert {"folded.model.toml", "folded.fmu", "report.html"} <= made
    assert not {"loop", "folded_inverse.fmu"} & made
    assert not json.loads((tmp_path / "mine" / "verdict.json").read_text())["approved"]
    assert "not monotone" in (tmp_path / "mine" / "report.html").read_text()


@pytest.mark.parametrize("rows", [100, 20_000])
def test_the_input_to_measure_next_ends_where_it_begins(rows: int) -> None:
    """Also for a slow record, whose speed would give too long a file."""
    u = 50 + 50 * np.sin(2 * np.pi * np.arange(2 * rows) / rows)
    found, _ = excitation(hy.Dataset(1e-3 * np.arange(len(u)), u, u), 1e3 / rows)
    assert found[0] == found[-1] == u[0]
    assert len(found) <= MOST_ROWS
    assert u.min() <= found.min() <= found.max() <= u.max()


def test_a_sweep_that_the_record_cannot_carry_is_written_at_a_higher_rate(tmp_path: Path) -> None:
    u = 50 + 50 * np.sin(2 * np.pi * np.arange(4000) / 500)
    data = hy.Dataset(1e-3 * np.arange(len(u)), u, u)
    line = write_excitation(tmp_path / "next.csv", data, 2.0, up_to=1400.0)
    t, v = np.loadtxt(tmp_path / "next.csv", delimiter=",", skiprows=1).T
    assert 1 / (t[1] - t[0]) == pytest.approx(7000)
    assert line.endswith("at 7000 Hz: the record has 1000 Hz, enough for a chirp up to 200 Hz only")
    assert v[0] == v[-1] == u[0]
    power = np.abs(np.fft.rfft(v - v.mean())) ** 2
    f = np.fft.rfftfreq(len(v), t[1] - t[0])
    assert power[(f > 700) & (f < 1300)].mean() > 100 * power[f > 1800].mean()
    with pytest.raises(InputError, match="'up_to' of an excitation must be"):
        write_excitation(tmp_path / "none.csv", data, 2.0, up_to=-1.0)
    assert not (tmp_path / "none.csv").exists()


# ---- as it comes -----------------------------------------------------------------------------------------------------
DATA = Path(os.environ.get("HYSTFMU_DATA", Path(__file__).parents[3] / "shared" / "data"))
MEASURED = DATA / "dbo_piezo" / "Test_Vi_Do_Di.dat"


def _measured(path: Path) -> None:
    if not MEASURED.exists():
        pytest.skip(f"measured data absent: {MEASURED}")
    rows = np.loadtxt(MEASURED)
    lines = ["Zeit [ms];Spannung [V];Auslenkung [µm]"]
    lines += [f"{5 * k:.1f};{r[0]:.6f};{r[4]:.6f}".replace(".", ",") for k, r in enumerate(rows)]
    path.write_text("\r\n".join(lines), encoding="cp1252")


def _poor(path: Path) -> None:
    k = np.arange(300)
    u = 50 + 50 * np.exp(-0.003 * k) * np.sin(2 * np.pi * k / 50)
    noise = np.random.default_rng(3).normal(0, 0.003, 300)
    hy.Dataset(1e-3 * k, u, displacement(u, 1e-3) + noise).to_csv(path)


RECORDS = {"demo": lambda path: piezo(seed=0).to_csv(path), "measured": _measured, "poor": _poor}


@pytest.mark.stress
@pytest.mark.parametrize("record", RECORDS)
def test_ends_with_a_loop_and_a_whole_report(record: str, tmp_path: Path) -> None:
    RECORDS[record](tmp_path / "data.csv")
    found = invoked(["start", str(tmp_path / "data.csv"), "-o", str(tmp_path / "mine"), "--json"])
    told = json.loads(found.stdout)
    assert all(Path(f["path"]).exists() for f in told["files"].values())
    page = (tmp_path / "mine" / "report.html").read_text()
    assert page.index('<p class="answer">verdict: ') < page.index("before: a gain alone")
    assert all(f">{title}</h2>" in page for title in ("Errors", "Model", "Controller"))
    if record == "poor":
        assert any("informative" in w for w in told["fit"]["warnings"])
        assert (tmp_path / "mine" / "measure_next.csv").exists()
