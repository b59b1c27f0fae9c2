"""What several commands share: exit statuses, options of a data file, `--set name=value`, `--json`."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from hystfmu.errors import InputError

if TYPE_CHECKING:
    from hystfmu.data import Dataset

FAILED, BAD_INPUT = 1, 2

json_option = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")


def data_options(f: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options that say which columns of a file are time, input and output, and at which rate."""
    for option in (
        click.option(
            "--resample",
            is_flag=False,
            flag_value="median",
            metavar="[HZ]",
            help="Bring uneven steps to this rate, or to the median step; gaps are refused.",
        ),
        click.option("--rate", type=float, metavar="HZ", help="Sample rate, when the file has no time column."),
        click.option("--output", default="y", show_default=True, help="Name of the output column."),
        click.option("--input", "input_", default="u", show_default=True, help="Name of the input column."),
        click.option("--time", default="t", show_default=True, help="Name of the time column (s)."),
    ):
        f = option(f)
    return f


def assignments(pairs: tuple[str, ...]) -> dict[str, Any]:
    """The pairs of `--set name=value`: values are JSON where they can be, else text."""
    values: dict[str, Any] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals or not name:
            raise InputError(f"--set {pair}: write it as name=value")
        try:
            values[name] = json.loads(text)
        except json.JSONDecodeError:
            values[name] = text
    return values


def read(
    path: str,
    time: str,
    input_: str,
    output: str | None,
    rate: float | None,
    resample: str | None,
    train: str | None = None,
) -> Dataset:
    """The data file that `data_options` describe; `output` None reads no output column."""
    from hystfmu.data import Dataset

    try:
        to: Any = resample if resample in (None, "median") else float(resample)
    except ValueError:
        raise InputError(f"--resample {resample}: write a rate in Hz, or nothing for the median step") from None
    return Dataset.from_csv(path, time, input_, output, rate, train, to)
