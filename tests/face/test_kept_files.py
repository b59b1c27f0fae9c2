"""No file of other content is replaced without --force; default names hold record and kind."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

import hystfmu as hy
from hystfmu.cli import main

ROOT = Path(__file__).parents[2]
KIND = "prandtl_ishlinskii"
STAYS = "exists with other content. Name another file, or replace it with --force."
# words of a command, a file that it writes, whether its content is the same each time (else it states times)
WRITERS = {
    "fit": (f"fit a.csv --model {KIND} --set N=5 -o out/m.toml", "m.toml", True),
    "page of a fit": (f"fit a.csv --model {KIND} --set N=5 -o m.model.toml --report out", f"a.{KIND}.html", True),
    "predict": ("predict good.model.toml a.csv -o out/y.csv", "y.csv", True),
    "inverse": ("inverse good.model.toml -o out/i.model.toml", "i.model.toml", True),
    "export": ("export good.model.toml -o out/x.fmu", "x.fmu", True),
    "controller as C": ("export loop --controller --c out --name law", "law.c", True),
    "run": ("run loop --case sine_10 --engine native -o out/y.csv", "y.csv", True),
    "page of a run": ("run loop --case sine_10 --engine native --report out", "report.html", False),
    "junit": ("run loop --case sine_10 --engine native --junit out/j.xml", "j.xml", False),
    "ssp": ("ssp loop --case sine_10 -o out/x.ssp", "x.ssp", True),
    "compare": ("compare before before -o out/d.html", "d.html", True),
}


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("inputs")
    hy.synthetic.piezo(20, 500.0, seed=1).to_csv(folder / "a.csv")
    hy.synthetic.piezo(20, 500.0, seed=2).to_csv(folder / "b.csv")
    hy.fit(hy.read(folder / "a.csv"), KIND, N=5).save(folder / "good.model.toml")
    loop = hy.Scenario.load(ROOT / "scenarios" / "pid")
    loop.save(folder / "loop")
    hy.run(loop, case="sine_10", engine="native", report=folder / "before")
    return folder


@pytest.fixture
def here(inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    shutil.copytree(inputs, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    Path("out").mkdir()
    return tmp_path


def call(words: str, *more: str) -> Result:
    return CliRunner().invoke(main, [*words.split(), *more])


def listed(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.mark.parametrize("name", WRITERS)
def test_a_command_keeps_a_file_of_other_content(name: str, here: Path) -> None:
    command, file, same = WRITERS[name]
    target = here / "out" / file
    target.write_text("mine")
    before = listed(here)
    done = call(command)
    assert (done.exit_code, done.stderr) == (2, f"hystfmu: {Path('out', file)}: {STAYS}\n"), done.output
    assert listed(here) == before, "nothing of the others is written"
    forced = call(command, "--force")
    assert forced.exit_code == 0, forced.output
    assert target.read_bytes() != b"mine"
    made = listed(here)
    again = call(command)
    assert again.exit_code == (0 if same else 2), again.output
    assert listed(here) == made


def test_records_and_kinds_have_files_of_their_own(here: Path) -> None:
    for name, source in (("Mess 1", "a"), ("Mess 2", "b")):
        Path(f"{source}.csv").rename(f"{name}.csv")
    asked = [("Mess 1", KIND), ("Mess 2", KIND), ("Mess 1", "polynomial_narx")]
    for name, kind in asked:
        done = call("fit", f"{name}.csv", "--model", kind)
        assert done.exit_code == 0, done.output
    files = [f"{name}.{kind}.model.toml" for name, kind in asked]
    models = [hy.Model.load(f) for f in files]
    assert len({(m.key, m.provenance["sha256"]) for m in models}) == len(asked)
    assert all(Path(f).with_name(f.replace(".model.toml", ".html")).exists() for f in files)


def test_another_record_or_kind_is_refused_before_its_fit(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert call(f"fit a.csv --model {KIND} -o m.toml").exit_code == 0
    monkeypatch.setattr(hy, "fit", lambda *a, **k: pytest.fail("fitted all the same"))
    for words in (f"b.csv --model {KIND}", "a.csv --model play_bank_mlp", f"a.csv --model {KIND} --train :300"):
        done = call(f"fit {words} -o m.toml")
        assert (done.exit_code, done.stderr.splitlines()[-1]) == (2, f"hystfmu: m.toml: {STAYS}")


def test_a_modelica_package_of_another_model_stays(here: Path) -> None:
    words = "export good.model.toml --modelica out --name Mine"
    assert [call(words).exit_code for _ in range(2)] == [0, 0]
    before = listed(here / "out")
    call(f"fit b.csv --model {KIND} -o good.model.toml --force")
    done = call(words)
    assert (done.exit_code, done.stderr) == (2, f"hystfmu: good.model.toml: {Path('out', 'Mine')}: {STAYS}\n")
    assert listed(here / "out") == before
    assert call(words, "--force").exit_code == 0
    assert listed(here / "out") != before


@pytest.mark.stress
def test_a_designed_scenario_stays_whole(here: Path) -> None:
    """Its files are written all or none."""
    words = "design integral loop -o out"
    first = call(words)
    assert first.exit_code in (0, 1), first.output
    made = listed(here / "out")
    assert call(words).exit_code == first.exit_code
    assert listed(here / "out") == made
    (here / "out" / "scenario.toml").write_text("# mine\n" + (here / "out" / "scenario.toml").read_text())
    for name in [n for n in made if n != "scenario.toml"]:
        (here / "out" / name).unlink()
    done = call(words)
    assert (done.exit_code, done.stderr.splitlines()[-1]) == (2, f"hystfmu: {Path('out', 'scenario.toml')}: {STAYS}")
    assert os.listdir("out") == ["scenario.toml"]
    assert call(words, "--force").exit_code == first.exit_code
    assert listed(here / "out") == made


def test_a_study_keeps_to_its_folder(here: Path) -> None:
    pytest.importorskip("pyarrow")
    for name in ("one", "two"):
        text = f'name = "{name}"\nscenario = "loop"\ncases = ["sine_10"]\nmethod = "grid"\nengine = "native"\n'
        Path(f"{name}.study.toml").write_text(text + '[parameters."pid.Kp"]\nvalues = [1.0]\n')
    Path("out", "report.html").write_text("mine")
    done = call("study one.study.toml -o out -j 1")
    assert (done.exit_code, done.stderr) == (2, f"hystfmu: {Path('out', 'report.html')}: {STAYS}\n")
    assert os.listdir("out") == ["report.html"]
    assert [call("study one.study.toml -o new -j 1").exit_code for _ in range(2)] == [0, 0]
    other = call("study two.study.toml -o new -j 1")
    assert other.exit_code == 2
    assert "holds the table of the study one of" in other.stderr


def test_files_that_belong_together_are_written_all_or_none(here: Path) -> None:
    Path("out", "law.c").write_text("mine")
    assert call(WRITERS["controller as C"][0]).exit_code == 2
    assert os.listdir("out") == ["law.c"], "no law.h, no temporary file"


def test_in_python_a_file_is_replaced(here: Path) -> None:
    Path("m.toml").write_text("mine")
    model = hy.Model.load("good.model.toml")
    model.save("m.toml")
    assert hy.Model.load("m.toml").key == model.key
