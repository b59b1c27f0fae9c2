"""The scripts for OpenModelica name every model that they should; with omc on the path they run."""

from __future__ import annotations

import shutil
import subprocess

import library
import pytest

SCRIPTS = library.ROOT / "Resources" / "Scripts" / "OpenModelica"


def test_scripts_name_every_example_and_operator() -> None:
    for script, packages in (("Examples", ("Examples",)), ("Operators", ("Sampled", "Events", "Smooth"))):
        body = (SCRIPTS / f"{script}.mos").read_text()
        for package in packages:
            folder = library.ROOT / (package if script == "Examples" else f"Validation/{package}")
            for name in (folder / "package.order").read_text().split():
                assert f"{package}.{name})" in body, name


@pytest.mark.openmodelica
@pytest.mark.skipif(shutil.which("omc") is None, reason="omc, the OpenModelica compiler, is not installed")
@pytest.mark.parametrize("script", ["Check", "Examples", "Operators"])
def test_script_runs_without_an_error(script: str) -> None:
    command = ["omc", str(SCRIPTS / f"{script}.mos")]
    done = subprocess.run(command, capture_output=True, text=True, cwd=library.ROOT.parent, timeout=1800, check=False)
    assert done.returncode == 0, done.stderr
    assert "Error" not in done.stdout
