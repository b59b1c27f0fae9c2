"""The example workflow for GitHub, step by step in a repository that holds nothing but a scenario."""

import os
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest
import yaml

import hystfmu as hy

ROOT = Path(__file__).parents[3]
STEPS = yaml.safe_load((ROOT / "scenarios" / "github-workflow.example.yml").read_text())["jobs"]["scenarios"]["steps"]
pytestmark = [
    pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed"),
    pytest.mark.skipif(sys.platform == "win32", reason="the workflow runs on Linux"),
]


def git(folder: Path, *words: str) -> None:
    who = ["-c", "user.name=test", "-c", "user.email=test@localhost", "-c", "init.defaultBranch=main"]
    subprocess.run(["git", *who, *words], cwd=folder, check=True, capture_output=True)


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A clone of a repository with one scenario and its baseline."""
    origin = tmp_path / "origin"
    plays: dict[str, Any] = {"w0": 0.3, "r": [0.1, 0.3], "w": [0.4, 0.3]}
    loop = hy.Scenario("compensated", step=1e-3, stop=0.3, text="an exact inverse in front of two plays")
    loop.add("reference", hy.blocks.Reference(frequency=10.0))
    loop.add("inverse", hy.blocks.PrandtlIshlinskiiInverse(**plays))
    loop.add("plant", hy.blocks.PrandtlIshlinskii(**plays))
    loop.connect("reference.r", "inverse.y").connect("inverse.u", "plant.u")
    loop.metric("tracking", "rms_percent", "plant.y", against="reference.r", limit=0.1)
    loop.save(origin / "scenarios" / "compensated")
    hy.run(origin / "scenarios" / "compensated", record=True)
    git(tmp_path, "init", "origin")
    git(origin, "add", ".")
    git(origin, "commit", "-m", "a scenario")
    git(tmp_path, "clone", "origin", "here")
    return tmp_path / "here"


def statuses(folder: Path) -> dict[str, int]:
    """Exit status of each step that runs commands, as for a pull request; that of the installation is left out."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "GITHUB_BASE_REF": "main"}
    found = {}
    for step in STEPS:
        if "run" in step and step["name"] != "Install":
            shell = ["bash", "-e", "-c", step["run"]]
            found[step["name"]] = subprocess.run(shell, cwd=folder, env=environment, capture_output=True).returncode
    return found


@pytest.mark.stress
def test_it_passes_and_shows_what_a_branch_changes(repository: Path) -> None:
    assert list(statuses(repository).values()) == [0, 0]
    (suite,) = ET.parse(repository / "new" / "junit.xml").getroot()
    assert (suite.get("name"), suite.get("tests"), suite.get("failures")) == ("compensated", "1", "0")
    assert "All" in (repository / "new" / "changes.html").read_text()


@pytest.mark.stress
def test_a_branch_that_breaks_a_limit_fails(repository: Path) -> None:
    file = repository / "scenarios" / "compensated" / "scenario.toml"
    file.write_text(file.read_text().replace("w0 = 0.3", "w0 = 0.33", 1))
    assert list(statuses(repository).values()) == [1, 0]
    (suite,) = ET.parse(repository / "new" / "junit.xml").getroot()
    assert suite.get("failures") == "1"
    assert "tracking" in (repository / "new" / "changes.html").read_text()


def test_it_installs_a_wheel_of_the_repository() -> None:
    (install,) = (step["run"] for step in STEPS if step.get("name") == "Install")
    assert install == "python -m pip install wheels/hystfmu-*.whl"
    (python,) = (step["with"] for step in STEPS if step.get("uses", "").startswith("actions/setup-python"))
    assert python["cache-dependency-path"] == "wheels/*.whl"
