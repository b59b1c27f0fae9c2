"""Options of a data file: its columns, sample rate and records."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import click

from hystfmu.base.errors import InputError

if TYPE_CHECKING:
    from hystfmu.data import Dataset


@dataclass(frozen=True)
class Columns:
    """Columns and sample rate of a data file, from the options of `data_options`."""

    time: str
    input_: str
    output: str
    rate: float | None
    resample: str | None
    lag: int
    record: str | None
    decimal: Literal[".", ","] | None
    covariates: tuple[str, ...] = ()

    def words(self) -> list[str]:
        """Return the given options, as words of a command line."""
        named = {"--time": self.time, "--input": self.input_, "--output": self.output, "--rate": self.rate}
        named |= {"--lag": self.lag, "--record": self.record, "--decimal": self.decimal}
        given = [w for name, value in named.items() if value for w in (name, f"{value}")]
        given += [] if self.resample is None else [f"--resample={self.resample}"]
        return [*given, *(w for c in self.covariates for w in ("--covariate", c))]

    def read(self, path: str | Sequence[str], train: str | None = None, with_output: bool = True) -> Dataset:
        """Read a data file, or several data files as several records.

        Parameters
        ----------
        path : str or sequence of str
        train : str, optional
            Rows that a fit uses.
        with_output : bool
            Whether the file must have an output column. If False, an output is read only if its column is recognised
            without doubt.

        Raises
        ------
        InputError
            The rate is not a number, or the file is invalid (see `hystfmu.read`).
        """
        import hystfmu as hy

        try:
            to: Any = self.resample if self.resample in (None, "median") else float(self.resample)
        except ValueError:
            raise InputError(
                f"--resample must be a rate in Hz, or empty for the median step. Got {self.resample!r} instead."
            ) from None
        options: Any = {"rate": self.rate, "train": train, "resample": to, "lag": self.lag}
        options |= {"record": self.record, "decimal": self.decimal, "covariates": self.covariates}
        try:
            return hy.read(path, self.time, self.input_, self.output, **options)
        except InputError:
            if with_output or self.output:
                raise
            return hy.read(path, self.time, self.input_, None, **options)


def data_options(f: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options that name the time, input and output columns of a file and its sample rate.

    The command receives them as one argument, `columns`.
    """

    @functools.wraps(f)
    def command(
        time: str,
        input_: str,
        output: str,
        rate: float | None,
        resample: str | None,
        lag: int,
        record: str | None,
        decimal: Literal[".", ","] | None,
        covariates: tuple[str, ...],
        **others: Any,
    ) -> Any:
        return f(columns=Columns(time, input_, output, rate, resample, lag, record, decimal, covariates), **others)

    for option in (
        click.option(
            "--resample",
            is_flag=False,
            flag_value="median",
            metavar="[HZ]",
            help="Resample uneven steps to this rate; empty: to the median step.  A gap is an error.",
        ),
        click.option(
            "--decimal", type=click.Choice([".", ","]), help="Decimal sign, for ambiguous numbers such as 1,234."
        ),
        click.option(
            "--covariate",
            "covariates",
            multiple=True,
            metavar="COLUMN",
            help="Name or number of a column with a further input, such as load or temperature; repeatable.",
        ),
        click.option("--record", metavar="COLUMN", help="Column of record numbers; each record has its own memory."),
        click.option(
            "--lag",
            type=click.IntRange(0),
            default=0,
            metavar="ROWS",
            help="Delay of the output sensor in rows.  A fit reports the lag of the data.",
        ),
        click.option("--rate", type=float, metavar="HZ", help="Sample rate of a file without a time column."),
        click.option("--output", default="", metavar="COLUMN", help="Name or number of the output column."),
        click.option("--input", "input_", default="", metavar="COLUMN", help="Name or number of the input column."),
        click.option(
            "--time",
            default="",
            metavar="COLUMN",
            help="Name or number of the time column, from 1; its unit of measure is converted.  Columns that are not "
            "stated are recognised by their names, such as t, u, y, or by their units of measure.",
        ),
    ):
        option(command)
    return command
