"""The examples in the docstrings of the face run and print what they say; every name of the face has one."""

import doctest
import inspect
import sys
from pathlib import Path
from types import ModuleType

import pytest

import hystfmu as hy

CALLS = (
    "of_block",
    "from_torch",
    "predict",
    "score",
    "check",
    "plot",
    "inverse",
    "export",
    "export_modelica",
    "unit",
)  # methods of a model


def documented() -> dict[str, object]:
    """Everything that a user calls, by its name."""
    found: dict[str, object] = {"hystfmu": hy} | {name: getattr(hy, name) for name in hy.__all__}
    return found | {f"Model.{name}": getattr(hy.Model, name) for name in CALLS}


@pytest.mark.parametrize("name", documented())
def test_examples_print_what_they_say(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    thing = documented()[name]
    home = thing if isinstance(thing, ModuleType) else sys.modules[thing.__module__]
    text = inspect.getdoc(thing)
    assert text, name
    test = doctest.DocTestParser().get_doctest(text, {}, name, home.__file__, 0)
    assert test.examples, f"{name} shows no example"
    shown: list[str] = []
    result = doctest.DocTestRunner(verbose=False).run(test, out=shown.append)
    assert result.failed == 0, "".join(shown)
