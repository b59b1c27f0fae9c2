"""Commands that design a controller for the loop of a scenario. They write a new scenario with this controller."""

import math
import shlex
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from hystfmu.base import InputError, together
from hystfmu.cli.options import FILE, Command, WrittenFolder, json_option, of, structures
from hystfmu.cli.scenarios import found
from hystfmu.report.terminal import answer, say, wrong

if TYPE_CHECKING:
    from hystfmu.face.scenario import Scenario
    from hystfmu.redesign.controller import Controller
    from hystfmu.redesign.repetitive import Repetitive
    from hystfmu.scenario import Results


@click.group(short_help="Design a controller for the loop of a scenario.")
def design() -> None:
    """Design a controller for the loop of a scenario, and write a new scenario with this controller.

    \b
    Example: hystfmu start data.csv -o mine
             hystfmu design repetitive mine/loop -o mine/repetitive
             hystfmu run mine/repetitive
    """


@design.command(cls=Command, short_help="Add repetitive control for periodic references.")
@click.argument("scenario", type=FILE)
@of("", out=("-o DIR", {"required": True}))
@of("redesign.repetitive:repetitive", period="")
@of("", frequency="HZ")
@of("redesign.repetitive:repetitive", cutoff="", gain="")
@of("", percent="--off PERCENT")
@json_option
def repetitive(
    scenario: str, out: WrittenFolder, period: float | None, frequency: float | None, percent: float | None, **how: Any
) -> None:
    """Add repetitive control to a loop.

    SCENARIO is a folder with a stable loop, for example from 'hystfmu start'. The repetitive control adds a correction
    to the command of the existing controllers. In every case with a periodic reference, the error decreases from period
    to period. This also holds in all corners, that is, for the incremental gains and delays in the table [margins] of
    the scenario and for shifted natural frequencies. If --cutoff or --gain is too large, an error message states a
    possible value.

    The new scenario contains the filter coefficients. It contains only those cases of SCENARIO whose reference has the
    period that the repetitive control learns. Each of these cases is simulated with and without the
    correction. The exit status is 1 if a case or the loop violates a limit.

    \b
    Example: hystfmu design repetitive mine/loop -o mine/repetitive
             hystfmu design repetitive scenarios/stage/irc -o scan --frequency 100
    \f

    Parameters
    ----------
    out : str
        Folder of the new scenario.
    frequency : float in (0, inf), optional
        Frequency of the reference. It is given instead of --period.
    percent : float in [0, 90], optional
        Assumed error of the natural frequencies of the plant [default: 20, or less if the loop is unstable for 20].
    """
    from hystfmu.redesign import repetitive as design_repetitive
    from hystfmu.report.terminal import progress

    if period is not None and frequency is not None:
        raise InputError("Give either --period or --frequency. Got both.")
    (source,) = found([scenario])
    into = _folder(out, source)
    with progress("designing") as report:
        made = design_repetitive(
            source,
            period=1 / frequency if frequency is not None else period,
            off=percent / 100 if percent is not None else None,
            progress=report,
            **how,
        )
    facts: dict[str, Any] = {
        "off": made.off,
        "period": made.period,
        "steps": made.steps,
        "cutoff": made.cutoff,
        "gain": made.gain,
        "taps": {"q": len(made.filters.q), "l": len(made.filters.l)},
        "worst_factor": made.worst[1],
        "worst_corner": made.worst[0],
    }
    lines = [
        f"period: {made.steps} steps, {made.period:.6g} s, {1 / made.period:.6g} Hz",
        f"each period corrects {made.gain:g} of the error up to {made.cutoff:.4g} Hz, also for modes shifted by "
        f"{100 * made.off:g} %",
        f"slowest corner {made.worst[0]}: each period multiplies errors up to {made.cutoff / 2:.4g} Hz by "
        f"{made.worst[1]:.3g}",
    ]
    _tell(made, lines, facts, into)


def _structure(name: str, text: str) -> None:
    """Add the command that designs a controller of one structure."""

    @design.command(
        name=name,
        cls=Command,
        short_help=f"{text[0].upper()}{text[1:]}.",
        help=f"""Replace the controllers of a loop by a tuned controller: {text}.

        SCENARIO is a folder with a closed loop. One new unit replaces all units between the measured output and the
        command. The new unit has the same inputs as the replaced units: reference, measurement and feed-forward. The
        new scenario.toml states the gains of the controller. The design uses the largest gain for which the peak of
        the sensitivity is below the limit of --ms. In addition, the peak must be below 12 dB in the loops of all cases,
        for the incremental gains and delays in the table [margins] of the scenario and for shifted natural frequencies.

        Each case is simulated with the old and with the new controllers. The new scenario does not contain cases that
        change parameters or connections of the old controllers. The exit status is 1 if a case or the loop violates a
        limit.

        \b
        Example: hystfmu design {name} mine/loop -o mine/{name}
        """,
    )
    @click.argument("scenario", type=FILE)
    @of("", out=("-o DIR", {"required": True}))
    @of("redesign.controller:controller", ms_db="--ms", bandwidth="")
    @of("", percent="--off PERCENT")
    @json_option
    def command(scenario: str, out: WrittenFolder, percent: float = 5.0, **how: Any) -> None:
        """Replace the controllers of a loop.

        Parameters
        ----------
        out : str
            Folder of the new scenario.
        percent : float in [0, 90]
            Assumed error of the natural frequencies of the plant, in addition to the variations in the cases.
        """
        from hystfmu.redesign import controller
        from hystfmu.report.terminal import progress

        (source,) = found([scenario])
        into = _folder(out, source)
        with progress("designing") as report:
            made = controller(source, name, off=percent / 100, progress=report, **how)
        facts: dict[str, Any] = {
            "structure": name,
            "gains": made.gains,
            "Ms_db": made.tuned.ms_db,
            "Ms_worst_db": made.tuned.set_ms_db,
            "worst_loop": made.tuned.worst,
            "loops": made.loops,
            "bandwidth_hz": made.tuned.bandwidth,
            "margins": vars(made.margins),
        }
        lines = [
            f"{text}: {', '.join(f'{k} = {v:g}' for k, v in made.gains.items())}",
            f"Ms {made.tuned.ms_db:.3g} dB; largest Ms of {made.loops} loops {made.tuned.set_ms_db:.3g} dB, at "
            f"{made.tuned.worst}",
            str(made.margins),
        ]
        _tell(made, lines, facts, into)


for _name, _text in structures().items():
    _structure(_name, _text)


def _tell(made: "Repetitive | Controller", lines: list[str], facts: dict[str, Any], into: Path) -> NoReturn:
    """Write the new scenario, print the design and the results of the cases, and end the command.

    The exit status is 0 if all limits are met, otherwise 1.
    """
    from hystfmu.report.terminal import table

    results, broken = made.results, _write(made.scenario, into, made.results)
    passed = results.passed and not broken
    cases = [_facts(r, made.before[r.case]) for r in results]
    say("\n".join(lines) + "\n")
    head = ["case", "metric", "before", "after", "limit", "verdict"]
    say(table(head, [[v if isinstance(v, str) else _number(v) for v in case.values()] for case in cases]))
    for line in broken:
        say(line)
    wrong([*(line for r in results for line in r.failures()), *broken])
    name = shlex.quote(str(into))
    say(f"wrote {into}: hystfmu run {name}; hystfmu margins {name}")
    answer(facts | {"passed": passed, "cases": cases, "broken": broken, "path": str(into)}, passed)


def _folder(out: str, source: Path) -> Path:
    """Return the folder of the new scenario.

    Raises
    ------
    InputError
        The folder is the folder of the scenario, or the path is a file.
    """
    into = Path(out)
    if into.exists() and not into.is_dir():
        raise InputError(f"{out}: The new scenario must be a folder. Got a file.")
    home = source if source.is_dir() else source.parent
    if into.resolve() == home.resolve():
        raise InputError(f"{out}: The new scenario must have a folder of its own. Got the folder of {source}.")
    return into


def _write(scenario: "Scenario", into: Path, results: "Results") -> list[str]:
    """Write a scenario, and return the violated limits of its loop as lines of text.

    If all limits are met, the results become the baseline of the scenario. The scenario is first written to a temporary
    folder. Therefore the target folder stays unchanged if one of its files must not be replaced.
    """
    from hystfmu.base import read_bytes, write_bytes
    from hystfmu.scenario import run
    from hystfmu.scenario.loop.table import margin_table

    with tempfile.TemporaryDirectory(prefix="hystfmu-design-") as folder:
        made = Path(folder, into.resolve().name)
        scenario.save(made)
        if results.passed:
            run(made, engine="native", record=True)
        broken = margin_table([made]).broken()
        with together():
            for file in sorted(made.iterdir()):
                write_bytes(into / file.name, read_bytes(file))
    return broken


def _facts(result: Any, before: float) -> dict[str, Any]:
    """Return the first metric of a case before and after the design, with its limit and its verdict."""
    first = result.verdicts[0] if result.verdicts else None
    return {
        "case": result.case,
        "metric": first.metric if first else "stopped",
        "before": before,
        "after": first.value if first else math.inf,
        "asked": first.limit if first else None,
        "verdict": "ok" if result.passed else "FAILED",
    }


def _number(x: float | None) -> str:
    return "" if x is None else f"{x:.3g}"
