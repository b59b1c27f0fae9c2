"""`validate` finds false dependencies and wrong derivatives, but accepts kinks, discontinuities and rounding."""

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from fmpy import read_model_description
from fmu_master import BLOCKS, loop, mixed, single, unpack

import hystfmu as hy
from hystfmu.fmu import export_fmu
from hystfmu.fmu.check.exchange_trials import exchange_dependencies
from hystfmu.fmu.check.foreign_library import ForeignFmu, tangent_differs
from hystfmu.graph import Graph

E = 1e-6
RAW = np.random.default_rng(0).normal(size=3)


@pytest.mark.parametrize(
    ("value", "good", "wrong"),
    [
        (lambda x: 3 * x + 1e3 * x * x, [3.0, 3.0002], [3.01, 2.99, -3.0, 0.0]),
        (lambda x: 3 * x if x > 0 else x, [3.0, 2.0, 1.0], [2.5, 1.5, 0.0]),  # a kink
        (lambda x: 0.5 if x > 0 else 0.0, [0.0, 1e7], []),  # a discontinuity has no derivative
        (lambda x: 7e11 + 1e4 * x + 1e-4 * RAW[int(np.sign(x)) + 1], [1e4], [2e4, 0.0]),  # rounded to 1e-4
    ],
)
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


@pytest.mark.parametrize(
    ("make", "unknown", "words"),
    [
        (mixed, 0, ["y depends on dyn_v_1", "y depends on dyn_v_2"]),
        (mixed, 3, ["h depends on u"]),
        (mixed, 4, ["der(dyn_v_1) depends on dyn_v_2"]),
        (mixed, 5, ["der(dyn_v_2) depends on u", "der(dyn_v_2) depends on dyn_v_1", "der(dyn_v_2) depends on dyn_v_2"]),
        (lambda: single("pid"), 0, ["u depends on y_d", "u depends on y", "u depends on u_ff"]),  # at a sample
        (lambda: single("mlp"), 0, ["y depends on u_1", "y depends on u_2"]),
    ],
)
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
