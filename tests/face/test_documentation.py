"""Every public object documents its arguments and errors; imports form no circle."""

import ast
import importlib
import inspect
import re
from pathlib import Path

import pytest

import hystfmu

ROOT = Path(hystfmu.__file__).parent
PUBLIC = (
    "hystfmu", "hystfmu.model.accuracy", "hystfmu.design", "hystfmu.fmu", "hystfmu.model.from_torch",
    "hystfmu.identify", "hystfmu.inverse", "hystfmu.modelica", "hystfmu.redesign", "hystfmu.scenario",
    "hystfmu.data.signals", "hystfmu.studies", "hystfmu.data.synthetic",
)  # fmt: skip


def public_functions():
    """Qualified name, function, and the text that may explain its arguments."""
    found = {}
    for home in PUBLIC:
        module = importlib.import_module(home)
        for name in module.__all__:
            thing = getattr(module, name)
            if inspect.isfunction(thing):
                found[f"{home}.{name}"] = thing, inspect.getdoc(thing) or ""
            elif inspect.isclass(thing) and thing.__module__.startswith("hystfmu"):
                whole = inspect.getdoc(thing) or ""
                found[f"{home}.{name}"] = thing, whole
                for key, member in vars(thing).items():
                    f = getattr(member, "__func__", member)
                    if inspect.isfunction(f) and not key.startswith("_"):
                        found[f"{home}.{name}.{key}"] = f, inspect.getdoc(f) or ""
    return found


FOUND = public_functions()


def arguments(thing):
    try:
        names = inspect.signature(thing).parameters
    except ValueError:  # an exception
        return []
    return [n for n in names if n not in ("self", "cls", "args", "kwargs")]


def undocumented(thing, text):
    """Return the arguments that the text does not mention."""
    return [n for n in arguments(thing) if not re.search(rf"(?<!\w){n}(?!\w)", text)]


def test_there_is_something_to_walk():
    assert {"hystfmu.read", "hystfmu.identify.fit", "hystfmu.scenario.run"} <= set(FOUND)


@pytest.mark.parametrize("name", FOUND)
def test_every_argument_is_documented(name):
    thing, text = FOUND[name]
    assert text, f"{name} has no docstring"
    assert undocumented(thing, text) == [], name


@pytest.mark.parametrize("name", FOUND)
def test_what_raises_says_so(name):
    thing, text = FOUND[name]
    made = vars(thing).get("__init__", vars(thing).get("__post_init__")) if inspect.isclass(thing) else thing
    if made is None or not inspect.isfunction(made):
        return
    try:
        tree = ast.parse(inspect.cleandoc("\n" + inspect.getsource(made)))
    except OSError:  # made by dataclass
        return
    raises = {
        ast.unparse(n.exc.func) for n in ast.walk(tree) if isinstance(n, ast.Raise) and isinstance(n.exc, ast.Call)
    }
    for error in raises & {"InputError", "Stopped"}:
        assert error in text.partition("Raises\n------")[2], f"{name} raises {error}"


def test_the_walk_finds_an_undocumented_argument():
    def speak(loudness: float, words: str) -> None:
        """Say the words."""

    assert undocumented(speak, inspect.getdoc(speak)) == ["loudness"]
