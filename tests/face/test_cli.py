"""Command line: exit status, one-line errors for invalid input, atomic writes."""

import contextlib
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.cli import main, scenarios

ROOT = Path(__file__).parent.parent.parent


def hystfmu(*arguments, cwd="."):
    """Run a command in this process, which has imported the package; return status and streams."""
    with contextlib.chdir(cwd):
        done = CliRunner().invoke(main, [str(a) for a in arguments], prog_name="hystfmu")
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return SimpleNamespace(returncode=done.exit_code, stdout=done.stdout, stderr=done.stderr)


def process(*arguments, cwd=None):
    """Run a command as a process, which also shows warnings and piped output."""
    return subprocess.run(
        [sys.executable, "-m", "hystfmu.cli", *map(str, arguments)], capture_output=True, text=True, cwd=cwd,
        timeout=120,
    )  # fmt: skip


def write(path, rows, head="t,u,y"):
    path.write_text("\n".join([head, *[",".join(map(str, r)) for r in rows]]) + "\n")
    return path


def record(n=800):
    """A sum of three plays and a linear term, driven by a decaying sine."""
    t = np.arange(n) * 0.005
    u = 10 + 8 * np.exp(-0.4 * t) * np.sin(2 * np.pi * t)
    z, y = np.zeros(3), []
    for x in u:
        z = np.maximum(x - np.array([0.5, 1.5, 3]), np.minimum(x + np.array([0.5, 1.5, 3]), z))
        y.append(0.4 * x + z.sum() * 0.2)
    return [[f"{a:.4f}", f"{b:.10g}", f"{c:.10g}"] for a, b, c in zip(t, u, y, strict=True)]


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A CSV, a model fitted to it, and what the command printed."""
    folder = tmp_path_factory.mktemp("fitted")
    write(folder / "data.csv", record())
    done = process("fit", folder / "data.csv", "--model", "prandtl_ishlinskii", "-o", folder / "m.model.toml")
    assert done.returncode == 0, done.stderr
    return folder, done.stdout


@pytest.mark.turn("a terminal")
def test_fit_prints_one_table_and_no_escape_codes_in_a_pipe(fitted):
    folder, out = fitted
    read, head = out.splitlines()[:2]
    assert read == "read data.csv: time 't' in s (no unit of measure is stated), input 'u', output 'y'"
    assert head.split("  ")[0] == "model"
    for word in ("prandtl_ishlinskii", "parameters", "RMS %FS", "max %FS", "seconds"):
        assert word in out
    assert "\x1b" not in out
    assert (folder / "m.model.toml").exists()


def test_fit_as_json(fitted):
    folder, _ = fitted
    done = hystfmu(
        "fit", folder / "data.csv", "--model", "prandtl_ishlinskii", "-o", folder / "j.model.toml", "--json",
        "--train", "100:700", "--set", "N=12",
    )  # fmt: skip
    result = json.loads(done.stdout)
    assert result["model"] == "prandtl_ishlinskii"
    assert result["rms_percent"] < 1


@pytest.mark.turn("a terminal")
def test_predict_export_validate_inverse(fitted, tmp_path, monkeypatch):
    monkeypatch.setitem(
        sys.modules, "fmu_manipulation_toolbox", None
    )  # tests/fmu has it; it takes longer than the rest
    folder, _ = fitted
    model = folder / "m.model.toml"
    done = process("predict", model, folder / "data.csv", "-o", tmp_path / "out.csv")
    assert done.returncode == 0, done.stderr
    out = np.loadtxt(tmp_path / "out.csv", delimiter=",", skiprows=1)
    measured = np.loadtxt(folder / "data.csv", delimiter=",", skiprows=1)
    assert np.sqrt(np.mean((out[:, 2] - measured[:, 2]) ** 2)) < 0.01 * np.ptp(measured[:, 2])
    fmu = tmp_path / "x.fmu"
    assert hystfmu("export", model, "--fmi", 3, "-o", fmu).returncode == 0
    checked = hystfmu("validate", fmu)
    assert checked.returncode == 0, checked.stdout
    assert "0 problems" in checked.stdout
    inverted = hystfmu("inverse", model, "-o", tmp_path / "inv.model.toml")
    assert inverted.returncode == 0, inverted.stderr


def damaged(rows, row, column, value):
    rows = [list(r) for r in rows]
    rows[row][column] = value
    return rows


@pytest.mark.parametrize(("rows", "head", "words"), [
    ([(*row, 0.0) for row in record()], "t,u,z,w",
     ["The output must be one of the columns. Got t, u, z, w", "--output"]),
    (damaged(record(), 17, 1, "nan"), "t,u,y", ["line 19", "u", "nan"]),
    (damaged(record(), 30, 2, "abc"), "t,u,y", ["line 32", "abc"]),
    (damaged(record(), 40, 0, "0.1"), "t,u,y", ["line 42", "0.1"]),
    (record()[:2], "t,u,y", ["rows"]),
    ([], "t,u,y", ["rows"]),
], ids=["missing column", "NaN", "not a number", "time goes back", "too short", "empty"])  # fmt: skip
def test_a_bad_csv_is_one_line_and_exit_status_2(tmp_path, rows, head, words):
    path = write(tmp_path / "bad.csv", rows, head)
    out = tmp_path / "m.model.toml"
    one_line(hystfmu("fit", path, "--model", "prandtl_ishlinskii", "-o", out), ["bad.csv", *words])
    assert list(tmp_path.iterdir()) == [path], "something was left behind"


def one_line(done, words):
    assert done.returncode == 2, (done.stdout, done.stderr)
    lines = done.stderr.strip().splitlines()
    assert len(lines) == 1, done.stderr
    assert lines[0].startswith("hystfmu: ")
    for w in words:
        assert w in lines[0]


@pytest.mark.turn("files of commands")
@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("scale", "words"),
    [("e200", ("line 2", "u must be at most 1e+100")), ("e-200", ("span of u in the training rows", "1e-100"))],
)
def test_values_whose_squares_overflow_or_vanish_are_refused(tmp_path, scale, words):
    path = write(tmp_path / "a.csv", [[t, u + scale, y + scale] for t, u, y in record(80)])
    done = process("fit", path, "--model", "prandtl_ishlinskii", "-o", tmp_path / "m.toml")
    assert done.returncode == 2, done.stderr
    assert all(w in done.stderr for w in words), done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["a.csv"]


def test_fewer_rows_than_parameters_are_warned_about(tmp_path):
    done = hystfmu("fit", write(tmp_path / "a.csv", record(20)), "--model", "prandtl_ishlinskii", "-o", tmp_path / "m")
    assert done.returncode == 0
    assert "parameters from 20 training rows" in done.stderr


def test_bad_options_of_fit(fitted, tmp_path):
    folder, _ = fitted
    data, out = folder / "data.csv", tmp_path / "m.model.toml"
    one_line(hystfmu("fit", data, "--model", "preisch", "-o", out), ["preisch", "prandtl_ishlinskii"])
    one_line(hystfmu("fit", data, "--model", "bouc_wen", "-o", out, "--set", "q=1"), ["q"])
    one_line(hystfmu("fit", data, "--model", "bouc_wen", "-o", out, "--set", "q"), ["name=value"])
    one_line(hystfmu("fit", data, "--model", "prandtl_ishlinskii", "-o", out, "--train", "10"), ["10"])
    one_line(hystfmu("fit", data, "--model", "prandtl_ishlinskii", "-o", out, "--train", "10:100000"), ["train"])
    one_line(hystfmu("fit", tmp_path / "none.csv", "--model", "bouc_wen", "-o", out), ["none.csv"])
    assert not out.exists()


def test_bad_model_files(fitted, tmp_path):
    folder, _ = fitted
    text = (folder / "m.model.toml").read_text()
    for name, content, words in (
        ("broken", text[: len(text) // 2] + "= [", ["must be valid TOML"]),
        ("unknown", text.replace('type = "prandtl_ishlinskii"', 'type = "preisch"'), ["preisch"]),
        ("range", text.replace("depth = 256", "depth = -1"), ["depth", "-1"]),
    ):
        assert content != text
        path = tmp_path / f"{name}.model.toml"
        path.write_text(content)
        one_line(hystfmu("export", path, "-o", tmp_path / "x.fmu"), [path.name, *words])
    assert not (tmp_path / "x.fmu").exists()


def test_run_needs_a_scenario(tmp_path):
    one_line(hystfmu("run", cwd=tmp_path), ["--all"])
    (tmp_path / "scenarios").mkdir()
    one_line(hystfmu("run", "--all", cwd=tmp_path), ["scenario"])
    done = hystfmu("run", tmp_path / "none", cwd=tmp_path)
    one_line(done, ["none", "No such file"])
    assert "must be valid TOML" not in done.stderr
    (tmp_path / "scenario.toml").write_text("name = [")
    one_line(hystfmu("run", tmp_path, cwd=tmp_path), ["scenario.toml", "must be valid TOML"])


@pytest.mark.parametrize(("words", "says"), [
    (("fit", "peizo.csv"), "peizo.csv: No such file or directory. Did you mean 'piezo.csv'?"),
    (("fit", "lab/piezo.csv"), "lab/piezo.csv: No such file or directory. Did you mean 'labs'?"),
    (("run", "scenarios/pdi"), "scenarios/pdi: No such file or directory. Did you mean 'scenarios/pid'"),
    (("run", "piezo.csv"), "piezo.csv: The scenario must be a folder with a scenario.toml"),
    (("predict", "piezo.csv", "piezo.csv", "-o", "o.csv"), "Is it another kind of file? A model ends with .model.toml"),
    (("fit", "piezo.csv", "--model", "prandtl"), "Got 'prandtl' instead. Did you mean 'prandtl_ishlinskii'?"),
    (("blocks", "pidd"), "Got 'pidd' instead. Did you mean 'pid'?"),
    (("fit", "piezo.csv", "--modle", "auto"), "No such option '--modle'."),
    (("predict", "piezo.csv"), "Missing argument 'DATA'. See 'hystfmu predict --help'."),
    (("predict", "piezo.csv", "piezo.csv"), "Missing option '-o'. See 'hystfmu predict --help'."),
    (("predict", "labs", "piezo.csv", "-o", "o.csv"), "labs: The file must be a regular file. Got a folder."),
    (("export", "delay", "--set", "n=abc", "-o", "d.fmu"),
     "The 'n' size of delay must be an int in [1, 1000000]. Got abc"),
    (("export", "delay", "--set", "m=3", "-o", "d.fmu"), "A parameter of delay must be one of y0 (sizes: n). Got 'm'"),
    (("fit", "piezo.csv", "--input", "u", "--output", "u"),
     "The output must be a column of its own. Got 'u', the input."),
    (("fit", "piezo.csv", "--rate", "0,5"), "'0,5' is not a valid float: use a decimal point."),
    (("export", "delay", "--step", "1", "-o", "d.fmx"), "d.fmx: The file of an FMU must end in .fmu. Got '.fmx'"),
    (("frob",), "No such command 'frob'. See 'hystfmu --help'."),
])  # fmt: skip
def test_a_mistake_gets_one_line_with_what_was_meant(tmp_path, words, says):
    write(tmp_path / "piezo.csv", record(80))
    (tmp_path / "labs").mkdir()
    done = hystfmu(*words, cwd=tmp_path)
    assert done.returncode == 2
    complaints = [line for line in done.stderr.splitlines() if line.startswith("hystfmu: ")]
    assert len(complaints) == 1, done.stderr
    assert says in complaints[0]
    assert "Usage:" not in done.stderr


def test_blocks_lists_and_explains():
    overview = hystfmu("blocks").stdout
    assert "sliding_mode" in overview
    details = hystfmu("blocks", "sliding_mode").stdout
    for word in ("epsilon", "k_i", "1/s", "source:"):
        assert word in details
    assert json.loads(hystfmu("blocks", "pid", "--json").stdout)[0]["name"] == "pid"
    one_line(hystfmu("blocks", "none"), ["none", "pid"])


def test_every_command_is_in_the_overview():
    overview = hystfmu("--help").stdout
    assert "..." not in overview.split("Begin:")[1], "a summary is cut off"
    assert [line for line in overview.splitlines() if line.endswith(":")][1:] == [
        f"{group}:" for group in ("Begin", "Identify", "Export", "Simulate", "Design", "Check")
    ]
    assert all(c in overview for c in main.commands)


def test_no_line_of_a_help_is_longer_than_a_terminal():
    within = [f"design {n}" for n in main.commands["design"].commands]
    for c in ["", *main.commands, *within]:
        assert max(map(len, hystfmu(*c.split(), "--help").stdout.splitlines())) <= 80, c


@pytest.mark.some(0.5)
def test_a_shell_completes_commands_options_and_files():
    def completed(*words):
        more = {"_HYSTFMU_COMPLETE": "bash_complete", "COMP_WORDS": " ".join(words), "COMP_CWORD": str(len(words) - 1)}
        code = "from hystfmu.cli import main; main(prog_name='hystfmu')"
        done = subprocess.run(
            [sys.executable, "-c", code], env=os.environ | more, capture_output=True, text=True, timeout=60
        )
        return done.stdout.split()

    assert completed("hystfmu", "mar") == ["plain,margins"]
    assert completed("hystfmu", "simulate", "--coupling", "jac") == ["plain,jacobi"]
    assert completed("hystfmu", "export", "m.model.toml", "-o", "x") == ["file,x"]


def test_run_names_the_command_that_simulates(tmp_path):
    for name in ("x.fmu", "x.ssp"):
        one_line(hystfmu("run", name, cwd=tmp_path), [f"'hystfmu simulate {name}'"])
    one_line(hystfmu("simulate", "loop", cwd=tmp_path), ["loop", "'hystfmu run'"])
    one_line(hystfmu("simulate", "x.ssp", "--input", "in.csv", cwd=tmp_path), ["--input is an option of .fmu files"])


def test_a_misspelt_kind_is_told_before_a_missing_file(tmp_path):
    (tmp_path / "piezo.fmu").touch()
    done = hystfmu("fit", "--model", "prandl", "piezo.csv", cwd=tmp_path)
    one_line(done, ["Got 'prandl' instead. Did you mean 'prandtl_ishlinskii'?"])
    assert "piezo.fmu" not in done.stderr


def test_every_fault_of_a_file_is_told(tmp_path):
    (tmp_path / "scenario.toml").write_text('nme = "x"\nstep = -1\nstop = 1.0\norder = ["a"]\n')
    done = hystfmu("run", "scenario.toml", cwd=tmp_path)
    one_line(done, ["nme: There is no such key. Did you mean 'name'?", "name: The key is required."])
    one_line(done, ["step: The value must be greater than 0. Got -1 instead.", "units: The key is required."])
    assert done.stderr.count("scenario.toml") == 1


def test_a_process_for_a_foreign_fmu_does_not_import_what_is_slow():
    code = (
        "import sys\nimport hystfmu.scenario.engine.simulation, hystfmu.scenario.run_fmu\n"
        "print([m for m in ('torch', 'control', 'scipy', 'matplotlib') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout.strip() == "[]", done.stdout + done.stderr


def test_version():
    assert "0.2.0" in process("--version").stdout


@pytest.mark.turn("good FMUs")
def test_a_bare_block_is_exported(tmp_path):
    """A block with given sizes and values; the FMU holds them."""

    fmu = tmp_path / "g0.fmu"
    poles = ["--set", "b=[9.8696e6]", "--set", "a=[1.0, 4398.2, 9.8696e6]"]
    assert hystfmu("export", "transfer_function", *poles, "--step", "1e-4", "-o", fmu).returncode == 0
    assert not hy.validate(fmu)
    with zipfile.ZipFile(fmu) as z:
        description = z.read("modelDescription.xml").decode()
    assert 'start="4398.2"' in description
    assert 'stepSize="0.0001"' in description
    one_line(hystfmu("export", "transfer_functio", "-o", fmu), ["transfer_functio", "transfer_function"])
    one_line(hystfmu("export", "zhao_tan", "--set", "nothing=1", "-o", fmu), ["zhao_tan", "'nothing'"])
    one_line(hystfmu("export", "m.model.toml", "--set", "a=1", "-o", fmu), ["--set", "single block"])


def test_shipped_scenarios_run_by_their_names_where_there_is_no_such_folder(tmp_path):
    done = hystfmu("run", "scenarios/example_hold", "--engine", "native", cwd=tmp_path)
    assert done.returncode == 0, done.stdout
    assert done.stderr.startswith("using the scenarios that HystFMU ships, in ")
    assert hystfmu("margins", "scenarios/pid", "--case", "sine_10", cwd=tmp_path).returncode == 0
    one_line(hystfmu("run", "scenarios/no_such", cwd=tmp_path), ["scenarios/no_such"])
    own = tmp_path / "scenarios" / "example_hold"
    own.mkdir(parents=True)
    (own / "scenario.toml").write_text("name = 1\n")
    one_line(hystfmu("run", "scenarios/example_hold", cwd=tmp_path), ["scenarios/example_hold/scenario.toml", "name"])


def test_all_without_a_folder_of_scenarios_means_the_shipped_ones(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {p.name for p in scenarios.chosen("run", (), True)}
    assert {"pid", "example_hold"} <= names
    (tmp_path / "scenarios" / "mine").mkdir(parents=True)
    (tmp_path / "scenarios" / "mine" / "scenario.toml").touch()
    assert [p.name for p in scenarios.chosen("run", (), True)] == ["mine"]


def test_no_baseline_is_written_into_the_package(monkeypatch):
    monkeypatch.setattr("hystfmu.base.PACKAGE", ROOT / "scenarios")
    with pytest.raises(InputError, match="--record writes beside"):
        scenarios.refuse_shipped([ROOT / "scenarios" / "pid"])
    scenarios.refuse_shipped([ROOT / "elsewhere"])
