"""The command that simulates an FMU or an SSP archive of any origin."""

from __future__ import annotations

import json
import sys
from typing import Any, Literal

import click

from hystfmu.base.errors import InputError
from hystfmu.cli.options import FAILED, FILE, OUTPUT_FILE, Command, assignments, json_option, unconfined_option
from hystfmu.report.terminal import echo, say


class _Of(click.Option):
    """An option for one kind of file. The help lists the option in the section of this kind.

    Parameters
    ----------
    of : str
        Suffix of the file, without the dot.
    """

    def __init__(self, *words: Any, of: str, **named: Any) -> None:
        super().__init__(*words, **named)
        self.of = of


class _Simulate(Command):
    """The command `simulate`. Its help has a separate section for the options of each kind of file."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the common options first, then the options of each kind of file."""
        sections: dict[str, list[tuple[str, str]]] = {
            "Options": [],
            "Options of an FMU": [],
            "Options of an archive": [],
        }
        titles = {"fmu": "Options of an FMU", "ssp": "Options of an archive"}
        for option in self.get_params(ctx):
            if isinstance(option, click.Option) and (record := option.get_help_record(ctx)):
                sections[titles[option.of] if isinstance(option, _Of) else "Options"].append(record)
        for title, records in sections.items():
            with formatter.section(title):
                formatter.write_dl(records)


@click.command(cls=_Simulate)
@click.argument("file", type=FILE, metavar="X.fmu|X.ssp")
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="NAME=VALUE",
    help="Override a parameter (of an archive: COMPONENT.NAME=VALUE); @FILE.json overrides all parameters in this "
    "file. Repeatable.",
)
@click.option("--step", type=float, metavar="SECONDS", help="Step [default: the step in the file].")
@click.option("--stop", type=float, metavar="SECONDS", help="Stop time [default: the stop time in the file].")
@click.option(
    "--timeout",
    type=click.FloatRange(0, min_open=True),
    default=600.0,
    show_default=True,
    metavar="SECONDS",
    help="Time limit of the run.",
)
@unconfined_option
@click.option("-o", "--out", type=OUTPUT_FILE, metavar="OUT.csv", help="CSV file for all outputs.")
@json_option
@click.option(
    "--input",
    "given",
    cls=_Of,
    of="fmu",
    type=FILE,
    metavar="IN.csv",
    help="Table of inputs: a column of time, and a column with the name of each input.",
)
@click.option(
    "--engine",
    cls=_Of,
    of="ssp",
    type=click.Choice(["fmpy", "native"]),
    default="fmpy",
    show_default=True,
    help="fmpy simulates FMUs (reference); native runs exported blocks in the C core, with the same bits.",
)
@click.option(
    "--coupling",
    cls=_Of,
    of="ssp",
    type=click.Choice(["gauss_seidel", "jacobi", "iterative"]),
    help="Coupling scheme of the components [default: the scheme in the archive].",
)
@click.pass_context
def simulate(
    context: click.Context,
    file: str,
    settings: tuple[str, ...],
    step: float | None,
    stop: float | None,
    timeout: float,
    unconfined: bool,
    out: str | None,
    as_json: bool,
    given: str | None,
    engine: Literal["fmpy", "native"],
    coupling: Literal["gauss_seidel", "jacobi", "iterative"] | None,
) -> None:
    """Simulate an FMU or an SSP archive of any origin.

    The FMU may have the version 1.0, 2.0 or 3.0 of FMI. If the FMU supports Co-Simulation, this interface is used;
    otherwise Model Exchange runs with an adaptive integrator. Inputs are constant during a step. Continuous inputs are
    interpolated between the rows of the table.

    If an archive contains a reference result for these settings, the command compares its result with the reference.
    The exit status is 1 if the results differ.

    \b
    Example: hystfmu simulate loop.ssp -o out.csv
             hystfmu simulate pump.fmu --input in.csv --set k=2 -o out.csv
    """
    from hystfmu.report.terminal import progress

    kind = file.rpartition(".")[2].lower()
    if kind not in ("fmu", "ssp"):
        raise InputError(f"{file}: The file must end with .fmu or .ssp. 'hystfmu run' runs scenarios.")
    for option in context.command.params:
        stated = context.get_parameter_source(option.name or "") is click.core.ParameterSource.COMMANDLINE
        if isinstance(option, _Of) and option.of != kind and stated:
            raise InputError(f"{file}: {option.opts[-1]} is an option of .{option.of} files.")
    values = assignments(settings)
    if kind == "fmu":
        from hystfmu.scenario.run_fmu import run_fmu

        done = run_fmu(file, given, values, step, stop, timeout, out, not unconfined)
        if as_json:
            echo(json.dumps(done.summary()))
        else:
            say("\n".join(done.lines()))
        return
    from hystfmu.scenario.ssp.read import run_ssp

    with progress("simulating") as report:
        found = run_ssp(file, engine, coupling, step, stop, timeout, out, not unconfined, report, settings=values)
    if as_json:
        echo(json.dumps(found.summary()))
    else:
        (say if found.passed else echo)("\n".join(found.lines()))
    sys.exit(0 if found.passed else FAILED)
