"""The command line. The commands import slow modules only when they run, so that `hystfmu --help` is fast."""

import re
import shlex
from typing import Any

import click

from hystfmu import __version__
from hystfmu.base import InputError, extras
from hystfmu.base.printable import printable
from hystfmu.cli import begin, design, fmus, identify, scenarios
from hystfmu.cli.options import BAD_INPUT, INTERRUPTED, Command
from hystfmu.report.terminal import echo

__all__ = ["main"]

_GROUPS: dict[str, list[click.Command]] = {
    "Begin": [begin.start, begin.demo, begin.blocks],
    "Identify": [identify.fit, identify.predict, identify.inverse],
    "Export": [fmus.export, fmus.ssp],
    "Simulate": [scenarios.run, fmus.simulate, scenarios.study],
    "Design": [design.design, scenarios.margins],
    "Check": [identify.check, fmus.validate, scenarios.compare, begin.reproduce],
}
_COMMA = re.compile(r"'[-+]?\d*,\d+' is not a valid float")
_WORDS = "hystfmu.words"  # key of the command-line arguments in the context


class _Commands(click.Group):
    """Group of all commands. It lists the commands by purpose, and prints errors and interrupts as one line on stderr.

    The exit status is 2 after an `InputError` and 130 after an interrupt.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the names and short descriptions of the commands, each group under its title."""
        limit = formatter.width - 6 - max(map(len, self.commands))
        for title, group in _GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([(c.name or "", c.get_short_help_str(limit)) for c in group])

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        ctx.meta[_WORDS] = list(args)
        return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        try:
            with extras("this command"):  # for imports that do not state themselves which feature needs them
                return super().invoke(ctx)
        except click.UsageError as e:  # click would print four lines
            words = e.ctx.command_path if e.ctx else "hystfmu"
            text = printable(" ".join(e.format_message().split())).rstrip(".")
            if _COMMA.search(text):
                text += ": use a decimal point"
            echo(f"hystfmu: {text}{'' if text[-1] in '?)' else '.'} See '{words} --help'.", err=True)
            ctx.exit(BAD_INPUT)
        except InputError as e:
            echo(f"hystfmu: {e}", err=True)
            ctx.exit(BAD_INPUT)
        except KeyboardInterrupt:
            command = self.commands.get(ctx.invoked_subcommand or "")
            left = command.interrupted if isinstance(command, Command) else "again:"
            echo(f"hystfmu: interrupted; {left} {shlex.join(['hystfmu', *ctx.meta[_WORDS]])}", err=True)
            ctx.exit(INTERRUPTED)


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="hystfmu")
def main() -> None:
    """Identify the hysteresis of smart-material actuators, invert it, and export FMUs.

    \b
    Example: from measured data (columns t, u, y) to an FMU
      hystfmu fit data.csv --model prandtl_ishlinskii -o piezo.model.toml
      hystfmu export piezo.model.toml --fmi 2 -o piezo.fmu
      hystfmu start data.csv -o mine   does this, designs a loop, writes a report
      hystfmu demo                     runs the whole workflow on built-in data
    """


for _group in _GROUPS.values():
    for _command in _group:
        main.add_command(_command)
