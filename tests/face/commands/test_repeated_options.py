"""An option given twice: all of its values count, or one line says that it takes one; never silently the last."""

from __future__ import annotations

import click
import pytest
from click.testing import CliRunner

from hystfmu.cli import main

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
