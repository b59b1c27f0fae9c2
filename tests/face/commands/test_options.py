"""Options of commands: type, default and text of the argument that they set; each of one value is given once."""

import inspect
import typing
from collections.abc import Callable
from typing import Any

import click
import pytest
from click.testing import CliRunner

import hystfmu as hy
from hystfmu.cli import main
from hystfmu.cli.options import Command, of
from hystfmu.scenario import Engine

SHARED: list[tuple[str, Callable[..., Any], tuple[str, ...]]] = [
    ("run", hy.run, ("case", "engine", "coupling", "seconds", "out", "report", "set")),
    ("simulate", hy.run, ("engine", "coupling", "seconds")),
    ("study", hy.study, ("folder", "workers", "on", "retry")),
    ("validate", hy.validate, ("seconds",)),
    ("fit", hy.fit, ("seed", "purpose")),
    ("fit", hy.read, ("rate", "lag", "train", "decimal", "time")),
    ("export", hy.Model.export, ("path", "fmi", "platforms")),
    ("inverse", hy.Model.inverse, ("method", "seed")),
]


def option(command: str, name: str) -> click.Option:
    (found,) = (p for p in main.commands[command].params if p.name == name)
    assert isinstance(found, click.Option)
    return found


@pytest.mark.parametrize(("command", "function", "names"), SHARED)
def test_default_and_text_are_those_of_the_function(
    command: str, function: Callable[..., Any], names: tuple[str, ...]
) -> None:
    text = " ".join(inspect.getdoc(function).split()).replace("`", "")  # type: ignore[union-attr]
    for name in names:
        made, default = option(command, name), inspect.signature(function).parameters[name].default
        assert (
            made.default == default or str(made.default) == str(default) or default in (None, inspect.Parameter.empty)
        )
        told = (made.help or "").removesuffix(" Repeatable.").partition("--")[0].partition(" Repeatable.")[0]
        assert told
        assert told in text


def test_an_alias_of_a_literal_gives_the_choices() -> None:
    made = option("run", "engine").type
    assert isinstance(made, click.Choice)
    assert tuple(made.choices) == typing.get_args(Engine)


@pytest.mark.parametrize("given", [True, False])
def test_values_reach_the_function_under_the_names_of_its_arguments(given: bool) -> None:
    seen: dict[str, Any] = {}

    @of("scenario.running:run", case="NAME", seconds="--timeout", confined="", set="UNIT.NAME=VALUE", engine="")
    def command(**how: Any) -> None:
        seen.update(how)

    words = ["--case", "a", "--case", "b", "--timeout", "3", "--unconfined", "--set", "p.x=*2", "--set", "p.n=3"]
    click.command(cls=Command)(command).main(words if given else [], standalone_mode=False)
    usual = {"case": None, "seconds": 600.0, "confined": True, "set": {}, "engine": "fmpy"}
    stated = {"case": ("a", "b"), "seconds": 3.0, "confined": False, "set": {"p.x": "*2", "p.n": 3}}
    assert seen == usual | (stated if given else {})


# ---- given twice -----------------------------------------------------------------------------------------------------
REPEATABLE = {"--case", "--set", "--covariate", "--sheet", "--reference"}
ONCE = [
    pytest.param(name, option, id=f"{name} {option.opts[-1]}")
    for name, command in main.commands.items()
    for option in command.params
    if isinstance(option, click.Option) and not option.is_flag and not option.multiple
]


def test_only_these_are_repeatable() -> None:
    options = [o for c in main.commands.values() for o in c.params if isinstance(o, click.Option)]
    assert {o.opts[-1] for o in options if o.multiple} == REPEATABLE


@pytest.mark.parametrize(("name", "option"), ONCE)
def test_an_option_of_one_value_is_given_once(name: str, option: click.Option) -> None:
    value = option.type.choices[0] if isinstance(option.type, click.Choice) else "1"
    word = option.opts[-1]
    done = CliRunner().invoke(main, [name, word, str(value), word, str(value)])
    assert (done.exit_code, done.stderr) == (2, f"hystfmu: {word} takes one value. Got it 2 times.\n")


def test_a_name_is_set_once() -> None:
    done = CliRunner().invoke(main, ["export", "delay", "--set", "n=3", "--set", "n=4", "-o", "x.fmu"])
    assert (done.exit_code, done.stderr) == (2, "hystfmu: --set n takes one value. Got it more than once.\n")
