"""A problem never ends the list: after names, a description or a crash that is wrong all other checks are made."""

import json
from pathlib import Path
from typing import Any

import pytest
from bad_fmu import DESCRIPTION, SLEEPS, bad_fmu
from click.testing import CliRunner

from hystfmu.cli import main

pytestmark = pytest.mark.usefixtures("without_fmutool")

CRASH = "*(volatile int *)8 = 1;"
ON_NULL = f"-DFREE=if (!c) {CRASH}"
ALL = [
    "reading modelDescription.xml",
    "looking for contradictions in it",
    "looking for the binary",
    "making an instance",
    "reading the start values",
    "making 100 steps",
    "running a second instance",
    "reading outputs between the steps",
    "setting inputs between the steps",
    "resetting",
    "saving and restoring the state",
    "freeing NULL",
    "making steps of different lengths",
    "checking the dependencies",
    "comparing directional derivatives with differences",
    "making many steps",
    "loading and unloading",
    "loading from a folder with a space and non-ASCII letters",
]
RESET = "after reset u is 0.125 instead of its start value"  # the memory of this small unit is static
NAMES = ("der(der(x))", "previous(PI.x)")


def named(*names: str) -> str:
    """A description with structured names, and these as well."""
    local = "".join(
        f'<ScalarVariable name="{n}" valueReference="{k}" causality="local"><Real/></ScalarVariable>'
        for k, n in enumerate(names, 2)
    )
    text = DESCRIPTION.replace(' guid="bad"', ' guid="bad" variableNamingConvention="structured"')
    return text.replace("</ModelVariables>", f"{local}</ModelVariables>")


def validated(path: Path, seconds: float = 60.0) -> tuple[int, list[str], dict[str, dict[str, Any]]]:
    done = CliRunner().invoke(main, ["validate", str(path), "--seconds", str(seconds), "--json"])
    notes = json.loads(done.stdout)
    names = [c["name"] for c in notes["checks"]]
    assert names[0] == "archive"
    assert names[1:] == ALL
    assert sum(c["problems"] for c in notes["checks"]) == len(notes["problems"])
    problems = [RESET if p.startswith(RESET) else p for p in notes["problems"]]
    return done.exit_code, problems, {c["name"]: c for c in notes["checks"]}


def test_names_a_description_error_and_a_crash_at_once(tmp_path: Path) -> None:
    """FMUs of OpenModelica crash while NULL is freed and have such names."""
    text = named(*NAMES).replace('<Real start="0"/>', '<Real start="0" unit="V"/>')
    bad_fmu(tmp_path / "x.fmu", "", 0.5, "", ON_NULL, description=text)
    status, problems, checks = validated(tmp_path / "x.fmu")
    assert status == 1
    assert problems == [
        'The unit "V" of variable "u" (line 5) is not defined.',
        *(f'"{n}" (line 7) is not a legal variable name for naming convention "structured".' for n in NAMES),
        RESET,
        "the FMU crashed (SIGSEGV) while freeing NULL",
    ]
    assert checks["freeing NULL"]["tried"] == "not finished"
    assert "steps" in checks["making many steps"]["tried"]
    assert "not tried" not in json.dumps(checks)


def test_a_crash_in_a_step_shortens_the_other_runs(tmp_path: Path) -> None:
    bad_fmu(tmp_path / "x.fmu", CRASH.rstrip(";"))
    status, problems, checks = validated(tmp_path / "x.fmu")
    assert status == 1
    assert problems == ["the FMU crashed (SIGSEGV) while making 100 steps", RESET]
    assert "not tried" not in json.dumps(checks)


@pytest.mark.stress
def test_a_hang_takes_its_own_time_only(tmp_path: Path) -> None:
    bad_fmu(tmp_path / "x.fmu", "", 0.5, "", f"-DFREE=if (!c) {SLEEPS};")
    _, problems, checks = validated(tmp_path / "x.fmu", 12.0)
    assert problems == [RESET, "the FMU did not finish within 12 s while freeing NULL"]
    assert "steps" in checks["making many steps"]["tried"]


def test_what_needs_a_step_is_not_tried_without_one(tmp_path: Path) -> None:
    """The check does not repeat the same crash eleven times."""
    text = DESCRIPTION.replace("  <ModelVariables>", '  <DefaultExperiment startTime="1"/><ModelVariables>')
    bad_fmu(tmp_path / "x.fmu", CRASH.rstrip(";"), -9.0, description=text)
    _, problems, checks = validated(tmp_path / "x.fmu")
    assert problems == ["the FMU crashed (SIGSEGV) while making 100 steps"]
    assert checks["resetting"]["tried"] == "not tried: needs 'making 100 steps'"
    assert checks["freeing NULL"]["tried"] == "1 instance"
