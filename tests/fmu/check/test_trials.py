"""`validate` finds false dependencies and wrong derivatives, but accepts kinks, discontinuities and rounding."""

import json
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bad_fmu import DESCRIPTION, SLEEPS, bad_fmu
from click.testing import CliRunner
from fmpy import read_model_description
from fmu_master import BLOCKS, loop, mixed, single, unpack
from reference_fmus import reference_fmu

import hystfmu as hy
from hystfmu.cli import main
from hystfmu.fmu import export_fmu
from hystfmu.fmu.check.exchange_trials import exchange_dependencies
from hystfmu.fmu.check.foreign_library import ForeignFmu, tangent_differs
from hystfmu.graph import Graph

E = 1e-6
RAW = np.random.default_rng(0).normal(size=3)


@pytest.mark.parametrize(("value", "good", "wrong"), [
    (lambda x: 3 * x + 1e3 * x * x, [3.0, 3.0002], [3.01, 2.99, -3.0, 0.0]),
    (lambda x: 3 * x if x > 0 else x, [3.0, 2.0, 1.0], [2.5, 1.5, 0.0]),  # a kink
    (lambda x: 0.5 if x > 0 else 0.0, [0.0, 1e7], []),  # a discontinuity has no derivative
    (lambda x: 7e11 + 1e4 * x + 1e-4 * RAW[int(np.sign(x)) + 1], [1e4], [2e4, 0.0]),  # rounded to 1e-4
])  # fmt: skip
def test_derivative_against_differences(value: Callable[[float], float], good: list[float], wrong: list[float]) -> None:
    assert [tangent_differs(g, value, E) for g in good] == [""] * len(good)
    assert all(tangent_differs(w, value, E) for w in wrong)


def foreign(graph: Graph, folder: Path, fmi: int, edit: Callable[[str], str] = str) -> ForeignFmu:
    unpack(export_fmu(graph, folder / "x.fmu", fmi, "m"), folder / "x")  # type: ignore[arg-type]
    path = folder / "x" / "modelDescription.xml"
    before = path.read_text()
    path.write_text(edit(before))
    return ForeignFmu(folder / "x", read_model_description(str(folder / "x"), validate=False))


def forget(xml: str, unknown: int) -> str:
    """Clear the dependencies of one output or derivative in the model structure."""
    head, structure = xml.split("<ModelStructure>")
    listed = list(re.finditer(r'dependencies="[^"]*"', structure))[unknown]
    return f'{head}<ModelStructure>{structure[: listed.start()]}dependencies=""{structure[listed.end() :]}'


@pytest.mark.some(4)
@pytest.mark.parametrize(("make", "unknown", "words"), [
    (mixed, 0, ["y depends on dyn_v_1", "y depends on dyn_v_2"]),
    (mixed, 3, ["h depends on u"]),
    (mixed, 4, ["der(dyn_v_1) depends on dyn_v_2"]),
    (mixed, 5, ["der(dyn_v_2) depends on u", "der(dyn_v_2) depends on dyn_v_1", "der(dyn_v_2) depends on dyn_v_2"]),
    (lambda: single("pid"), 0, ["u depends on y_d", "u depends on y", "u depends on u_ff"]),  # at a sample
    (lambda: single("mlp"), 0, ["y depends on u_1", "y depends on u_2"]),
])  # fmt: skip
def test_a_dependency_that_is_not_declared_is_found_in_model_exchange(
    tmp_path: Path, fmi: int, make: Callable[[], Graph], unknown: int, words: list[str]
) -> None:
    found = list(exchange_dependencies(foreign(make(), tmp_path, fmi, partial(forget, unknown=unknown))))
    words = sorted({w.removesuffix("_1").removesuffix("_2") if " u_" in w and fmi == 3 else w for w in words})
    assert sorted(found) == [f"{w} at once, but modelDescription.xml says that it does not" for w in words]


def test_a_differentiator_behind_a_filter_passes(tmp_path: Path, fmi: int) -> None:
    """In a short step the input acts on the output; with the states held it does not, as declared."""
    here = foreign(mixed(), tmp_path, fmi)
    assert list(exchange_dependencies(here)) == []
    assert here.with_derivatives == {"ModelExchange"}  # sampled blocks answer in steps
    assert foreign(single("preisach"), tmp_path / "p", fmi).with_derivatives == {"CoSimulation", "ModelExchange"}


@pytest.mark.stress
@pytest.mark.parametrize("name", ["loop", "mixed", *BLOCKS])
def test_every_block_passes_the_check(tmp_path: Path, fmi: int, name: str) -> None:
    graph = {"loop": loop, "mixed": mixed}.get(name, lambda: single(name))()
    assert hy.validate(export_fmu(graph, tmp_path / "x.fmu", fmi, "m"), 120) == []  # type: ignore[arg-type]


# ---- A problem never ends the list: after names, a description or a crash that is wrong all other checks are made
pytestmark = pytest.mark.usefixtures("without_fmutool")

CRASH = "*(volatile int *)8 = 1;"
ON_NULL = f"-DFREE=if (!c) {CRASH}"
ALL = [
    "reading modelDescription.xml", "looking for contradictions in it", "looking for the binary", "making an instance",
    "reading the start values", "making 100 steps", "running a second instance", "reading outputs between the steps",
    "setting inputs between the steps", "resetting", "saving and restoring the state", "freeing NULL",
    "making steps of different lengths", "checking the dependencies",
    "comparing directional derivatives with differences", "making many steps", "loading and unloading",
    "loading from a folder with a space and non-ASCII letters",
]  # fmt: skip
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


@pytest.mark.turn("broken descriptions")
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


@pytest.mark.turn("broken binaries")
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


@pytest.mark.turn("broken binaries")
def test_what_needs_a_step_is_not_tried_without_one(tmp_path: Path) -> None:
    """The check does not repeat the same crash eleven times."""
    text = DESCRIPTION.replace("  <ModelVariables>", '  <DefaultExperiment startTime="1"/><ModelVariables>')
    bad_fmu(tmp_path / "x.fmu", CRASH.rstrip(";"), -9.0, description=text)
    _, problems, checks = validated(tmp_path / "x.fmu")
    assert problems == ["the FMU crashed (SIGSEGV) while making 100 steps"]
    assert checks["resetting"]["tried"] == "not tried: needs 'making 100 steps'"
    assert checks["freeing NULL"]["tried"] == "1 instance"


# ---- The Reference FMUs of the FMI project pass the check: every version and interface, without a false alarm
MODELS = {
    "fmi1cs": "BouncingBall Dahlquist Feedthrough Resource Stair VanDerPol",
    "fmi1me": "BouncingBall Dahlquist Feedthrough Stair VanDerPol",
    "fmi2": "BouncingBall Dahlquist Feedthrough Resource Stair VanDerPol",
    "fmi3": "BouncingBall Clocks Dahlquist Feedthrough Resource Stair StateSpace VanDerPol",
}
# of each version one with events, one without, and those with a trait of their own: clocks, arrays, an end by design
SOON = {
    *("fmi1cs/Stair", "fmi1me/BouncingBall", "fmi2/Feedthrough", "fmi2/Stair", "fmi2/VanDerPol"),
    *("fmi3/BouncingBall", "fmi3/Clocks", "fmi3/Feedthrough", "fmi3/StateSpace"),
}
REFERENCES = [
    pytest.param(name, marks=[pytest.mark.stress] * (name not in SOON))
    for folder, names in MODELS.items()
    for name in (f"{folder}/{model}" for model in names.split())
]
DEFECTS = {  # of some releases
    # two dependencies, one kind
    "fmi2/Feedthrough": [
        "The number of elements in the dependencies and dependenciesKind attributes of the outputs",
        "The number of elements in the dependencies and dependenciesKind attributes of the initial unknown",
    ],
    # setStartValues in its model.c leaves x0 as it is
    "fmi3/StateSpace": ["after reset x0 is 0.125 instead of its start value 0.0"],
}


@pytest.mark.turn("good FMUs")
@pytest.mark.some(1)
@pytest.mark.parametrize("name", REFERENCES)
def test_reference_fmu_passes(name: str) -> None:
    problems = hy.validate(reference_fmu(name))
    assert not [p for p in problems if not p.startswith(tuple(DEFECTS.get(name, ["-"])))], problems
