"""The command line.  Every slow import happens inside the command that needs it: `hystfmu --help` stays fast."""

from __future__ import annotations

from typing import Any

import click

from hystfmu import __version__
from hystfmu.base.errors import InputError
from hystfmu.cli import fmus, models, results, scenarios
from hystfmu.cli.options import BAD_INPUT

__all__ = ["main"]


class _Commands(click.Group):
    """Commands in the order of the work; bad input is one line on stderr and exit status 2."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except InputError as e:
            line = " ".join(str(e).split())
            click.echo(f"hystfmu: {line}", err=True)
            ctx.exit(BAD_INPUT)


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="hystfmu")
def main() -> None:
    """Identify hysteresis of smart-material actuators, invert it, hand it on as FMUs.

    \b
    Example: from a measurement (columns t, u, y) to an FMU
      hystfmu fit data.csv --model prandtl_ishlinskii -o piezo.model.toml
      hystfmu export piezo.model.toml --fmi 2 -o piezo.fmu
      hystfmu demo                       everything once, on built-in data
    """


for _command in (
    models.blocks,
    models.fit,
    models.predict,
    models.inverse,
    fmus.export,
    fmus.validate,
    scenarios.run,
    scenarios.compare,
    scenarios.ssp,
    scenarios.study,
    results.reproduce,
    results.demo,
):
    main.add_command(_command)
