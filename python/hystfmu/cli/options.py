"""What several commands share: exit statuses, options of a data file, `--set name=value`, `--json`."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from hystfmu.base.errors import InputError

if TYPE_CHECKING:
    from hystfmu.data import Dataset

FAILED, BAD_INPUT = 1, 2

json_option = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")


@dataclass(frozen=True)
class Columns:
    """What the options of `data_options` say: which columns a data file has, at which rate."""

    time: str
    input_: str
    output: str
    rate: float | None
    resample: str | None

    def read(self, path: str, train: str | None = None, with_output: bool = True) -> Dataset:
        """The data file at `path`.

        Raises
        ------
        InputError
            A rate that is no number, or what `Dataset.from_csv` refuses.
        """
        from hystfmu.data import Dataset

        try:
            to: Any = self.resample if self.resample in (None, "median") else float(self.resample)
        except ValueError:
            raise InputError(
                f"--resample {self.resample}: write a rate in Hz, or nothing for the median step"
            ) from None
        output = self.output if with_output else None
        return Dataset.from_csv(path, self.time, self.input_, output, self.rate, train, to)


def data_options(f: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options that say which columns of a file are time, input and output, and at which rate.

    The command gets them as one argument, `columns`.
    """

    @functools.wraps(f)
    def command(time: str, input_: str, output: str, rate: float | None, resample: str | None, **others: Any) -> Any:
        return f(columns=Columns(time, input_, output, rate, resample), **others)

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
        option(command)
    return command


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
