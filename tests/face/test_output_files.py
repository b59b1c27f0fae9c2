"""Files that commands write: other content, links, modes and special files stay; a missing folder is told first."""

import os
import shutil
import stat
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

import hystfmu as hy
from hystfmu import InputError
from hystfmu.base.files import read_bytes, write_bytes
from hystfmu.cli import main

ROOT = Path(__file__).parents[2]
KIND = "prandtl_ishlinskii"
STAYS = "exists with different content. Name another file, or replace it with --force."
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


@pytest.mark.turn("files of commands")
@pytest.mark.some(2)
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


@pytest.mark.turn("files of commands")
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
    assert "contains the table of the study one of" in other.stderr


def test_files_that_belong_together_are_written_all_or_none(here: Path) -> None:
    Path("out", "law.c").write_text("mine")
    assert call(WRITERS["controller as C"][0]).exit_code == 2
    assert os.listdir("out") == ["law.c"], "no law.h, no temporary file"


def test_an_fmu_that_must_stay_leaves_no_modelica_package(here: Path) -> None:
    Path("out", "x.fmu").write_text("mine")
    assert call("export good.model.toml -o out/x.fmu --modelica out").exit_code == 2
    assert os.listdir("out") == ["x.fmu"]


def test_in_python_a_file_is_replaced(here: Path) -> None:
    Path("m.toml").write_text("mine")
    model = hy.Model.load("good.model.toml")
    model.save("m.toml")
    assert hy.Model.load("m.toml").key == model.key


# ---- links, modes, special files -------------------------------------------------------------------------------------
posix = pytest.mark.skipif(sys.platform == "win32", reason="links, modes and pipes of POSIX")
OUTPUTS = ["fit x.csv -o", "predict m x.csv -o", "inverse m -o", "export delay -o", "compare a b -o"]
OUTPUTS += ["run s -o", "ssp s -o"]


@posix
@pytest.mark.parametrize("command", OUTPUTS)
def test_a_missing_folder_is_told_before_anything_runs(command: str, tmp_path: Path) -> None:
    out = tmp_path / "missing" / "x"
    done = CliRunner().invoke(main, [*command.split(), str(out)])
    told = f"hystfmu: {out}: cannot be written: there is no folder {out.parent}\n"
    assert (done.exit_code, done.stderr) == (2, told)
    assert not out.parent.exists()


@posix
def test_a_link_stays_and_its_file_is_written(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    link, file = tmp_path / "link", tmp_path / "there" / "file"
    link.symlink_to(file)
    for content in (b"new", b"changed"):
        write_bytes(link, content)
        assert link.is_symlink()
        assert file.read_bytes() == content
    assert os.listdir(file.parent) == ["file"]


@posix
@pytest.mark.parametrize("umask", [0o022, 0o077, 0o002])
def test_a_new_file_follows_the_umask_and_an_old_one_keeps_its_mode(umask: int, tmp_path: Path) -> None:
    before = os.umask(umask)
    try:
        write_bytes(tmp_path / "new", b"1")
        write_bytes(tmp_path / "old", b"1")
        (tmp_path / "old").chmod(0o640)
        write_bytes(tmp_path / "old", b"2")
    finally:
        os.umask(before)
    modes = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("new", "old")]
    assert modes == [0o666 & ~umask, 0o640]


@posix
def test_pipes_devices_and_read_only_files_are_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    write_bytes(tmp_path / "protected", b"kept")
    (tmp_path / "protected").chmod(0o444)
    (tmp_path / "null").symlink_to("/dev/null")
    for name, why in [("pipe", "device, pipe"), ("protected", "read-only"), ("null", "device, pipe")]:
        with pytest.raises(InputError, match=f"{name}: cannot be written: it is .*{why}"):
            write_bytes(tmp_path / name, b"lost")
        done = CliRunner().invoke(main, ["export", "delay", "--step", "1e-3", "-o", str(tmp_path / name)])
        assert (done.exit_code, len(done.stderr.splitlines())) == (2, 1)
    assert (tmp_path / "protected").read_bytes() == b"kept"
    assert sorted(os.listdir(tmp_path)) == ["null", "pipe", "protected"]


@posix
@pytest.mark.parametrize(
    "command",
    ["fit IN -o m", "predict IN x -o y", "export IN.toml -o x", "validate IN", "run IN.toml", "simulate IN.ssp"],
)
def test_a_pipe_as_input_is_refused_and_not_waited_for(command: str, tmp_path: Path) -> None:
    source = tmp_path / "in"
    for suffix in ("", ".toml", ".ssp"):
        os.mkfifo(f"{source}{suffix}")
    done = CliRunner().invoke(main, command.replace("IN", str(source)).split())
    assert done.exit_code in (1, 2)
    assert "regular file" in done.output


@posix
def test_a_file_is_read_up_to_the_bound_even_if_its_stated_size_is_none() -> None:
    proc = Path("/proc/self/maps")  # a regular file of size 0 with some kB
    if not proc.exists():
        pytest.skip("needs /proc")
    with pytest.raises(InputError, match="at most 100 bytes"):
        read_bytes(proc, 100)
