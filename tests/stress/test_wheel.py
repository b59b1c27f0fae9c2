"""The wheel, which `make` does not need: built from a copy of the tree, used in a fresh environment, elsewhere."""

import os
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MADE = (".*", "__pycache__", "_core.*", "_fmu.*", "_sources.c")
MADE_AT_THE_TOP = ("build", "demo", "dist")  # a package may have such a name


def left_out(folder: str, names: list[str]) -> set[str]:
    """Names in a folder of the tree that no commit contains."""
    patterns = MADE + (MADE_AT_THE_TOP if Path(folder) == ROOT else ())
    return shutil.ignore_patterns(*patterns)(folder, names)


def run(*command: str | Path, cwd: Path) -> str:
    """What a command prints that has to succeed, without any path to this repository."""
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=1200)
    assert done.returncode == 0, (done.stdout + done.stderr)[-3000:]
    return done.stdout


@pytest.mark.stress
def test_wheel_in_a_fresh_environment(tmp_path: Path) -> None:
    tree = shutil.copytree(ROOT, tmp_path / "tree", ignore=left_out)
    shutil.copy(ROOT / ".gitignore", tree)
    stale = tree / "python" / "hystfmu" / "_core.so"
    stale.write_bytes(b"left there by make dev; git ignores it, and so must the wheel")
    pip = ["-m", "pip", "--quiet", "--constraint", ROOT / "constraints.txt"]
    build = [*pip[:2], "wheel", *pip[2:], "--no-deps", "--no-build-isolation", "--wheel-dir", tmp_path / "wheels", tree]
    run(sys.executable, *build, cwd=tmp_path)
    (wheel,) = (tmp_path / "wheels").glob("hystfmu-*.whl")
    with zipfile.ZipFile(wheel) as archive:
        packed = set(archive.namelist())
    modules = (ROOT / "python" / "hystfmu").rglob("*.py")
    assert {m.relative_to(ROOT / "python").as_posix() for m in modules} - packed == set()

    venv.create(tmp_path / "fresh", with_pip=True)
    bin_folder = tmp_path / "fresh" / ("Scripts" if sys.platform == "win32" else "bin")
    run(bin_folder / "python", *pip[:2], "install", *pip[2:], wheel, cwd=tmp_path)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    hystfmu = bin_folder / "hystfmu"
    assert "start   Build a compensated loop" in run(hystfmu, "--help", cwd=elsewhere)
    assert "both FMUs are valid" in run(bin_folder / "python", ROOT / "tests" / "release" / "wheel.py", cwd=elsewhere)
    shipped = run(
        bin_folder / "python",
        "-c",
        "from hystfmu.scenario.system.spec import shipped_scenarios; print(shipped_scenarios())",
        cwd=elsewhere,
    )
    assert Path(shipped.strip()).is_relative_to(tmp_path / "fresh")
    shutil.copytree(shipped.strip(), elsewhere / "scenarios")
    models = ROOT / "scenarios" / "models" / "backlash_plant.model.toml"
    run(hystfmu, "export", models, "--source", "-o", elsewhere / "plant.fmu", cwd=elsewhere)
    assert "0 problems" in run(hystfmu, "validate", elsewhere / "plant.fmu", cwd=elsewhere)
    run(hystfmu, "run", elsewhere / "scenarios" / "pid", "--engine", "native", cwd=elsewhere)
