"""Commands for FMUs: export and validate."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from hystfmu.base.errors import InputError
from hystfmu.cli.options import (
    FAILED,
    FILE,
    OUTPUT_FILE,
    OUTPUT_FOLDER,
    Command,
    assignments,
    json_option,
    unconfined_option,
)
from hystfmu.report.terminal import VERBOSE, echo, level, say

if TYPE_CHECKING:
    import hystfmu as hy
    from hystfmu.graph.blocks import Block


@click.command(cls=Command)
@click.argument("model", type=FILE, metavar="M.model.toml|BLOCK|SCENARIO")
@click.option("-o", "out", type=OUTPUT_FILE, metavar="X.fmu", help="FMU to write.")
@click.option(
    "--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="Version of the FMI standard."
)
@click.option(
    "--name",
    metavar="NAME",
    help="Name of the FMU or the Modelica package [default: the name of the model file].",
)
@click.option(
    "--platforms",
    type=click.Choice(["host", "all"]),
    default="host",
    show_default=True,
    help="Platforms whose binaries the FMU contains.",
)
@click.option(
    "--source",
    is_flag=True,
    help="Add the C source to the FMU as one file with the data; it needs the FMI headers.",
)
@click.option(
    "--modelica", "folder", type=OUTPUT_FOLDER, metavar="DIR", help="Folder to write a Modelica package into."
)
@click.option(
    "--sheet", multiple=True, metavar="NAME=VALUE", help="Data sheet of the actuator in SI units (repeatable)."
)
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="Size or value of BLOCK (repeatable).")
@click.option("--step", type=float, metavar="SECONDS", help="Sample period of BLOCK, or of a model file without one.")
@click.option(
    "--in-range",
    is_flag=True,
    help="Add an output in_range: 1 if the input lies within the input range of the training rows, else 0.",
)
@click.option("--controller", is_flag=True, help="Export the controller of SCENARIO, without the plant.")
@click.option("--case", metavar="NAME", help="Case of SCENARIO [default: the first].")
@click.option(
    "--c", "target", type=OUTPUT_FOLDER, metavar="DIR", help="Folder to write the controller into as C, without FMI."
)
def export(
    model: str,
    out: str | None,
    fmi: str,
    name: str | None,
    platforms: Literal["host", "all"],
    source: bool,
    folder: str | None,
    sheet: tuple[str, ...],
    settings: tuple[str, ...],
    step: float | None,
    in_range: bool,
    controller: bool,
    case: str | None,
    target: str | None,
) -> None:
    """Export a model, a block, or the controller of a loop.

    A model becomes an FMU or a Modelica package. A block or a controller becomes an FMU.

    The FMU supports Co-Simulation and Model Exchange.  No compiler is needed.

    The Modelica package contains a record of the parameter values, a block and an example. The package uses the HystFMU
    library, which is installed with this program; the command prints the path of the library. If the output of the
    model is in a unit of length, the package also contains an actuator. The actuator is piezoelectric, with pins and
    flanges, if the input is in volts, and magnetostrictive if the input is in amperes. --sheet takes stroke (m),
    blocking_force (N), resonance (Hz) and damping. For a piezo actuator it also takes capacitance (F, small signal) and
    capacitance_ratio (mean over small signal). For a coil it takes inductance (H, mean) and resistance (ohm).

    --controller exports one unit with feed-forward, controller, inverse, known limits and anti-windup. The inputs of
    this unit are the reference r and the measured output y; its output is the command u. The unit is called once per
    sample. The input u_present is the command before the start; the first command of the unit then has no jump.

    \b
    Example: hystfmu export piezo.model.toml --fmi 3 -o piezo.fmu
             hystfmu export piezo.model.toml --modelica .      writes ./Piezo
             hystfmu export piezo.model.toml --modelica . --sheet stroke=38e-6
             hystfmu export delay --set n=3 --step 1e-4 -o delay.fmu
             hystfmu export scenarios/pid --controller -o c.fmu
    """
    import hystfmu as hy

    version: Literal[2, 3] = 2 if fmi == "2" else 3
    if controller:
        others = {
            "--modelica": folder,
            "--set": settings,
            "--step": step,
            "--in-range": in_range,
            "--sheet": sheet,
        }
        if wrong := [option for option, value in others.items() if value]:
            raise InputError(f"--controller takes a scenario and -o X.fmu. Got {wrong[0]} as well.")
        _controller(model, out, version, case, name, platforms, source, target)
        return
    if Path(model).is_dir() or Path(model).name == "scenario.toml":
        raise InputError(f"{model}: A scenario must be exported with --controller, or by 'hystfmu ssp'. Got neither.")
    if case is not None or target is not None:
        raise InputError("--case and --c belong to the scenario of --controller. Got a model or block.")
    if sheet and folder is None:
        raise InputError("--sheet describes the actuator of --modelica DIR")
    if out is None and folder is None:
        raise InputError("export needs -o X.fmu, --modelica DIR, or both")
    if Path(model).suffix:
        if settings:
            raise InputError("--set gives the values of a bare block. A model file has its own.")
        loaded = hy.Model.load(model)
        if step is not None:
            loaded = _stepped(loaded, step)
    else:
        loaded = hy.Model.of_block(_block(model, assignments(settings)), step)
    if in_range:
        loaded = loaded.with_in_range()
    own = Path(model).name.removesuffix(".toml").removesuffix(".model") if Path(model).suffix else None
    if folder is not None:
        from hystfmu.modelica.actuator import actuator_told
        from hystfmu.modelica.package import package_name
        from hystfmu.modelica.realisation import left_out
        from hystfmu.modelica.shipped import shipped_library

        file = Path(model).name
        package, data = name or package_name(own or file), assignments(sheet) if sheet else None
        try:
            written = loaded.export_modelica(Path(folder) / package, file, data)
        except InputError as e:
            raise InputError(f"{model}: {e}") from None
        say(f"wrote {written}: Modelica package {written.name}, block {written.name}.Model")
        for kind, why in left_out(loaded.graph).items():
            say(f"no realisation {kind}: {why}")
        if (written / "Actuator.mo").is_file():
            say(f"actuator {written.name}.Actuator between pins and flanges, example {written.name}.ActuatorExample")
        for line in actuator_told(loaded, data):
            say(line)
        say(f"library path of HystFMU, which it uses: {shipped_library()}")
    if out is None:
        return
    path = loaded.export(out, version, name or own, platforms, source)
    _wrote(path, version, source)


def _stepped(model: hy.Model, step: float) -> hy.Model:
    """Set the sample period of a model file that has none."""
    if model.step is not None:
        raise InputError(f"--step must be left out: the model was identified with a step of {model.step:g} s")
    if not 0 < step < float("inf"):
        raise InputError(f"--step must be a number of seconds above 0. Got {step:g} instead.")
    return replace(model, step=step)


def _wrote(path: Path, fmi: int, source: bool) -> None:
    say(f"wrote {path}: FMI {fmi}.0, {path.stat().st_size // 1024} kB")
    if source:
        say(f"its source is one C99 file; it needs fmi{fmi}Functions.h of the FMI standard and the C library")


def _controller(
    scenario: str,
    out: str | None,
    fmi: Literal[2, 3],
    case: str | None,
    name: str | None,
    platforms: Literal["host", "all"],
    source: bool,
    target: str | None,
) -> None:
    """Write the controller of a case, and print the units in it."""
    from hystfmu.cli import places
    from hystfmu.report.terminal import table
    from hystfmu.scenario import Cases
    from hystfmu.scenario.deploy import write_controller, write_target

    if out is None and target is None:
        raise InputError("export --controller needs -o X.fmu, --c DIR, or both")
    chosen = Cases(places.found([scenario])[0]).named(case)
    if target is not None:
        files, found = write_target(chosen, target, name)
        say(f"wrote {' and '.join(map(str, files))}: C99, {files[0].stem}_start and {files[0].stem}_step")
    if out is not None:
        written = write_controller(chosen, out, fmi, name, platforms, source)
        found = written.controller
        _wrote(written.path, fmi, source)
    say(f"in it: {', '.join(found.units)}; left out: {', '.join(found.left_out)}")
    ports = [p for p in found.model.graph.ports if p.kind in ("input", "output")]
    rows = [[p.name, p.kind, "" if p.unit == "1" else p.unit, p.text] for p in ports]
    say(table(["port", "", "measured in", "meaning"], rows))
    say(f"one step for each sample, every {found.model.step:g} s")


def _block(name: str, values: dict[str, Any]) -> Block:
    """Return the block `name` with these sizes and values."""
    import hystfmu as hy
    from hystfmu.graph.listing import find

    made: Block = getattr(hy.blocks, find(name).class_name)(**values)
    return made


@click.command(cls=Command)
@click.argument("fmu", type=FILE)
@click.option("--seconds", default=60.0, show_default=True, help="Time limit of each check (s).")
@unconfined_option
@json_option
def validate(fmu: str, seconds: float, unconfined: bool, as_json: bool) -> None:
    """Check an FMU of any origin, of FMI 1.0, 2.0 or 3.0.

    The command checks the archive, applies the static checks of fmpy and fmutool, and runs the FMU in a child process.

    The runs check start values, repeatability, side effects of get and set, reset, saved states, two instances,
    dependencies, directional derivatives, memory leaks and folders with spaces.  They execute the code in the FMU.

    \b
    Example: hystfmu validate piezo.fmu
    """
    import hystfmu as hy
    from hystfmu.report.terminal import progress, table

    with progress("checking") as report:
        problems = hy.validate(fmu, seconds, not unconfined, report)
    if as_json:
        checks = [asdict(c) for c in problems.checks]
        echo(json.dumps({"file": fmu, "problems": problems, "checks": checks}))
    else:
        timed = level() == VERBOSE
        rows = [
            [c.name, c.tried or "does not apply", c.problems, *[f"{c.seconds:.2f}"] * timed] for c in problems.checks
        ]
        say(table(["check", "tried", "problems", *["seconds"] * timed], rows) + "\n")
        for p in problems:
            echo(p)
        n = len(problems.checks)
        say(f"{fmu}: {len(problems)} problem{'' if len(problems) == 1 else 's'} in {n} check{'' if n == 1 else 's'}")
    sys.exit(FAILED if problems else 0)
