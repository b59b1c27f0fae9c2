"""OpenModelica: library, exports and examples against the oracles that rumoca has; skipped where there is none.

`make openmodelica` runs this file.  The first tests need no OpenModelica: they hold what the others rely on.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import compare
import compare_block
import exported
import library
import numpy as np
import omc
import outcome
import pytest
import simulate
import test_equilibrium

SCRIPTS = library.ROOT / "Resources" / "Scripts" / "OpenModelica"
needed = [pytest.mark.openmodelica, pytest.mark.skipif(not omc.compiler(), reason=omc.REASON)]


def real(test):  # type: ignore[no-untyped-def]
    for mark in needed:
        test = mark(test)
    return test


def some(cases: Iterable[Any]) -> list[Any]:
    """All cases where OpenModelica is, else one that says that it is not."""
    return list(cases) if omc.compiler() else list(cases)[:1]


@pytest.fixture
def in_openmodelica(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every comparison simulates with OpenModelica."""
    monkeypatch.setattr(simulate, "rumoca", omc.simulate)
    monkeypatch.setattr(simulate, "_EXAMPLES", {})


def bound(o: outcome.Outcome, rumoca: float) -> float:
    """What an error may be: that of rumoca, events and held inputs apart."""
    package, kind = o.name.split(".")[1:3]
    own = omc.EVENTS if kind == "Events" else omc.HELD if kind in compare_block.HELD else 0.0
    return max(rumoca, own) if package == "Validation" else rumoca


# ---- without OpenModelica
def test_scripts_name_every_example_and_operator() -> None:
    """With the number of intervals: OpenModelica truncates StopTime/Interval of an annotation."""
    for script, packages in (("Examples", ("Examples",)), ("Operators", ("Sampled", "Events", "Smooth"))):
        body = (SCRIPTS / f"{script}.mos").read_text()
        for package in packages:
            folder = library.ROOT / (package if script == "Examples" else f"Validation/{package}")
            for name in (folder / "package.order").read_text().split():
                e = library.experiment_of((folder / f"{name}.mo").read_text())
                call = f"{package}.{name}, stopTime = "
                (line,) = (x for x in body.splitlines() if call in x)
                assert f"numberOfIntervals = {round(e['StopTime'] / e['Interval'])}, " in line


CHECK = """true
""
"Check of HystFMU.Control.Pid completed successfully.
Error String:
""
Number of classes checked / failed: 457/{failed}
"""


@pytest.mark.parametrize("failed", [0, 3])
def test_result_of_a_check_is_its_last_line(failed: int) -> None:
    assert omc.checked(CHECK.format(failed=failed)) == (457, failed)


def test_check_that_says_nothing_has_looked_at_nothing() -> None:
    assert omc.checked('Error String:\n""\n') == (0, 0)


# ---- with OpenModelica
def linked(folder: Path) -> Path:
    (folder / "HystFMU").symlink_to(library.ROOT)
    return folder


@real
def test_every_class_checks(tmp_path: Path) -> None:
    classes, failed = omc.checked(omc.run(SCRIPTS / "Check.mos", linked(tmp_path)))
    assert classes > 400
    assert failed == 0


@real
@pytest.mark.parametrize("script", some(["Examples", "Operators"]))
def test_script_has_a_result_of_every_simulation(script: str, tmp_path: Path) -> None:
    results = omc.result_files(omc.run(SCRIPTS / f"{script}.mos", linked(tmp_path)))
    assert len(results) == (SCRIPTS / f"{script}.mos").read_text().count("simulate(")
    assert all(results), results


@real
@pytest.mark.usefixtures("in_openmodelica")
@pytest.mark.parametrize("name", some(compare.models()))
def test_model_agrees(name: str) -> None:
    o = compare.compare(name)
    print(outcome.line(o))
    for error, limit in ((o.error_c, o.bound_c), (o.error_reference, o.tube)):
        assert np.isnan(limit) or error <= bound(o, limit)


@real
@pytest.mark.usefixtures("in_openmodelica")
@pytest.mark.parametrize("key", some(exported.KEYS))
def test_exported_kind_gives_what_predict_gives(key: str, tmp_path: Path) -> None:
    o = exported.compare(exported.small(key), key, tmp_path)
    assert o.good, exported.line(o)


@real
@pytest.mark.usefixtures("in_openmodelica")
@pytest.mark.parametrize("key", some(exported.CONTINUOUS_KEYS))
def test_realisations_give_what_predict_gives(key: str, tmp_path: Path) -> None:
    for o in exported.compare_realisations(exported.small(key), key, tmp_path):
        assert o.good, exported.line(o)


@real
@pytest.mark.usefixtures("in_openmodelica")
@pytest.mark.parametrize(("hysteresis", "kind", "count"), some(test_equilibrium.CASES))
def test_constant_voltage_moves_nothing(hysteresis: str, kind: str, count: int, tmp_path: Path) -> None:
    test_equilibrium.check(hysteresis, kind, count, tmp_path)
