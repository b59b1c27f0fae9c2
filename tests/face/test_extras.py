"""Optional packages that are missing: one line with the extra that brings them, in Python and on the command line."""

import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

import hystfmu as hy
from hystfmu.base.errors import EXTRAS, MissingExtra, extras
from hystfmu.cli import main

PROGRAM = """
import sys

class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {hidden!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)

sys.meta_path.insert(0, Hidden())
from hystfmu.cli import main
for arguments in {commands!r}:
    try:
        main(arguments)
    except SystemExit as e:
        print("status", e.code, flush=True)
"""
STUDY = """
name = "small"
scenario = "loop"
method = "{method}"
n = 2
[parameters."source.amplitude"]
range = [1.0, 2.0]
"""
OBJECTIVE = '[objective]\nmetric = "peak"\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Data, a model, a scenario and studies of it."""
    folder = tmp_path_factory.mktemp("extras")
    data = hy.synthetic.piezo(60, 1000.0)
    data.to_csv(folder / "piezo.csv")
    hy.fit(data, "prandtl_ishlinskii").save(folder / "m.model.toml")
    loop = hy.Scenario("loop", step=1e-3, stop=0.01).add("source", hy.blocks.Reference())
    loop.metric("peak", "peak", "source.r").save(folder / "loop")
    (folder / "sobol.study.toml").write_text(STUDY.format(method="sobol"))
    (folder / "optuna.study.toml").write_text(STUDY.format(method="optuna") + OBJECTIVE)
    return folder


def run_hidden(folder: Path, hidden: list[str], *commands: str) -> list[tuple[list[str], int]]:
    """For each command what it wrote to standard error and its status, with packages hidden."""
    program = PROGRAM.format(hidden=hidden, commands=[c.split() for c in commands])
    done = subprocess.run([sys.executable, "-c", program], cwd=folder, capture_output=True, text=True, check=False)
    statuses = [int(line.split()[1]) for line in done.stdout.splitlines() if line.startswith("status ")]
    lines = done.stderr.splitlines()
    assert len(statuses) == len(commands), done.stderr
    assert "Traceback" not in done.stderr
    assert len(lines) == len(commands), lines
    return [([line], status) for line, status in zip(lines, statuses, strict=True)]


@pytest.mark.stress
def test_without_torch_networks_are_trained_and_inverted(folder: Path):
    """Only modules that a user builds in torch need it."""
    commands = [
        "fit --models",
        "fit piezo.csv --model zhao_tan_mlp --train 0:2000 --set iterations=2 --set range=2.0 -o x.model.toml",
        "inverse m.model.toml --method learned --set iterations=2 -o i.model.toml",
    ]
    program = PROGRAM.format(hidden=["torch"], commands=[c.split() for c in commands])
    done = subprocess.run([sys.executable, "-c", program], cwd=folder, capture_output=True, text=True, check=True)
    assert [line for line in done.stdout.splitlines() if line.startswith("status ")] == ["status 0"] * len(commands)
    assert "pip install" not in done.stdout


@pytest.mark.turn("imports")
@pytest.mark.some(1)
@pytest.mark.parametrize(("hidden", "study"), [
    ("pyarrow", "sobol.study.toml -o a"),
    ("optuna", "optuna.study.toml -o b"),
    ("distributed", "-o c --on dask://x:1"),
])  # fmt: skip
def test_a_study_names_the_extra(folder: Path, hidden: str, study: str):
    command = study if study.endswith(("a", "b")) else f"sobol.study.toml {study}"
    (((line,), status),) = run_hidden(folder, [hidden], f"study {command}")
    assert f"needs {hidden}, which is not installed: pip install 'hystfmu[study]'" in line
    assert status == 2


def test_design_names_the_extra(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "control", None)
    pid = hy.blocks.Pid(Kp=1.0).node
    plant = hy.Node("g0", "transfer_function", {}, {"b": [1.0], "a": [1.0, 1.0]})
    for call in (lambda: hy.design.to_control(plant), lambda: hy.design.loop(plant, pid, 1e-3)):
        with pytest.raises(MissingExtra, match=r"pip install 'hystfmu\[control\]'") as e:
            call()
        assert "\n" not in str(e.value)
        assert isinstance(e.value, hy.InputError)


def test_other_missing_modules_stay_errors_of_the_program():
    with pytest.raises(ModuleNotFoundError, match="no_such_module"), extras("nothing"):
        import no_such_module  # noqa: F401


@pytest.mark.parametrize(("package", "extra"), sorted(EXTRAS.items()))
def test_an_import_that_nobody_guards_is_one_line_of_the_command(
    package: str, extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The commands themselves are the last guard, for instance for the `demo`."""

    def demo(_: Path, full: bool) -> None:
        raise ModuleNotFoundError(f"No module named '{package}.nn'", name=f"{package}.nn")

    monkeypatch.setattr("hystfmu.demo.demo", demo)
    done = CliRunner().invoke(main, ["demo"])
    told = f"hystfmu: this command needs {package}, which is not installed: pip install 'hystfmu[{extra}]'\n"
    assert (done.exit_code, done.stderr) == (2, told)
