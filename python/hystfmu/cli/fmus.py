"""Commands for FMUs and SSP archives: export, ssp, simulate and validate."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from hystfmu.base import InputError, together
from hystfmu.cli.options import FILE, OUTPUT_FILE, OUTPUT_FOLDER, Command, WrittenFile, WrittenFolder, json_option, of
from hystfmu.cli.scenarios import RUN, found
from hystfmu.report.terminal import VERBOSE, answer, echo, level, say

if TYPE_CHECKING:
    import hystfmu as hy
    from hystfmu.graph.blocks import Block

_EXPORT, _RUN_FMU = "face.model:Model.export", "scenario.run_fmu:run_fmu"


@click.command(cls=Command)
@click.argument("model", type=FILE, metavar="M.model.toml|BLOCK|SCENARIO")
@of(
    _EXPORT,
    path=("-o X.fmu", {"type": OUTPUT_FILE}),
    fmi="",
    name=("NAME", {"help": "Name of the FMU or of the Modelica package [default: the name of the model file]."}),
    platforms="",
    source="",
)
@of(
    "face.model:Model.export_modelica",
    folder=("--modelica DIR", {"type": OUTPUT_FOLDER, "help": "Write a Modelica package into this folder."}),
    sheet="",
)
@of(
    "",
    settings=("--set", {"help": "Size or parameter value of BLOCK. Repeatable."}),
    step="SECONDS",
    in_range="",
    controller="",
    case="NAME",
    target="--c DIR",
)
def export(
    model: str,
    folder: str | None,
    sheet: dict[str, Any],
    settings: Mapping[str, Any],
    step: float | None,
    in_range: bool,
    controller: bool,
    case: str | None,
    target: WrittenFolder | None,
    **how: Any,
) -> None:
    """Export a model, a block, or the controller of a loop.

    The command exports a model as an FMU or as a Modelica package, and a block or a controller as an FMU.

    The FMU supports Co-Simulation and Model Exchange. The export needs no compiler.

    The Modelica package contains a Modelica record of the parameter values, a block and an example. The package needs
    the Modelica library HystFMU, which is installed with this program. The command prints the path of this library. If
    the output of the model is a length, the package also contains an actuator with electrical pins and mechanical
    flanges. The actuator is piezoelectric if the input is in volts, and magnetostrictive if the input is in amperes.
    The option --sheet sets data-sheet values of the actuator: stroke (m), blocking_force (N), resonance (Hz) and
    damping. A piezoelectric actuator also has capacitance (small-signal value, F) and capacitance_ratio (mean value
    divided by small-signal value). A magnetostrictive actuator also has inductance (mean value, H) and resistance (ohm)
    of its coil.

    With --controller, the command exports one unit that contains feed-forward, controller, inverse, the known limits of
    the command, and anti-windup. The inputs of this unit are the reference r, the measured output y and u_present. The
    output is the command u. The unit must be called once per sample. The input u_present is the command that is applied
    before the start. The unit uses u_present to start without a jump of the command.

    \b
    Example: hystfmu export piezo.model.toml --fmi 3 -o piezo.fmu
             hystfmu export piezo.model.toml --modelica .      writes ./Piezo
             hystfmu export piezo.model.toml --modelica . --sheet stroke=38e-6
             hystfmu export delay --set n=3 --step 1e-4 -o delay.fmu
             hystfmu export scenarios/pid --controller -o c.fmu
    \f

    Parameters
    ----------
    settings : mapping
        Size or parameter value of BLOCK.
    step : float, optional
        Sample period of BLOCK, or of a model that has no sample period.
    in_range : bool
        Add the output in_range. It is 1 if the input lies in the input range of the training rows, else 0.
    controller : bool
        Export the controller of SCENARIO without the plant.
    case : str, optional
        Case of SCENARIO to export [default: the first case].
    target : str, optional
        Write the controller as C source without FMI into this folder.
    """
    import hystfmu as hy

    if controller:
        others = {"--modelica": folder, "--set": settings, "--step": step, "--in-range": in_range, "--sheet": sheet}
        if wrong := [option for option, value in others.items() if value]:
            raise InputError(f"--controller takes a scenario and -o X.fmu. Got {wrong[0]} as well.")
        _controller(model, case, target, how)
        return
    if Path(model).is_dir() or Path(model).name == "scenario.toml":
        raise InputError(f"{model}: A scenario must be exported with --controller, or by 'hystfmu ssp'. Got neither.")
    if case is not None or target is not None:
        raise InputError("--case and --c need --controller with a scenario. Got a model or block.")
    if sheet and folder is None:
        raise InputError("--sheet needs --modelica DIR, because it describes an actuator")
    if how["path"] is None and folder is None:
        raise InputError("export needs -o X.fmu, --modelica DIR, or both")
    if Path(model).suffix:
        if settings:
            raise InputError("--set needs a single block. Got a model file, which contains its values.")
        loaded = hy.Model.load(model)
        if step is not None:
            loaded = _stepped(loaded, step)
    else:
        loaded = hy.Model.of_block(_block(model, settings), step)
    if in_range:
        loaded = loaded.with_in_range()
    own = Path(model).name.removesuffix(".toml").removesuffix(".model") if Path(model).suffix else None
    with together():
        made = None if how["path"] is None else loaded.export(**how | {"name": how["name"] or own})
        written = None if folder is None else _package(loaded, folder, model, how["name"], sheet)
    if written is not None:
        _told(loaded, written, sheet)
    if made is not None:
        _wrote(made, how)


def _package(loaded: "hy.Model", folder: str, model: str, name: str | None, sheet: dict[str, Any]) -> Path:
    """Write a model as a Modelica package, and return the folder of the package."""
    from hystfmu.modelica.package import package_name

    file = Path(model).name
    package = name or package_name(file.removesuffix(".toml").removesuffix(".model"))
    try:
        return loaded.export_modelica(Path(folder) / package, file, sheet or None)
    except InputError as e:
        raise InputError(f"{model}: {e}") from None


def _told(loaded: "hy.Model", written: Path, sheet: dict[str, Any]) -> None:
    """Print what a Modelica package contains."""
    from hystfmu.modelica.actuator import actuator_told
    from hystfmu.modelica.classes import shipped_library
    from hystfmu.modelica.realisation import left_out

    say(f"wrote {written}: Modelica package {written.name}, block {written.name}.Model")
    for kind, why in left_out(loaded.graph).items():
        say(f"no realisation {kind}: {why}")
    if (written / "Actuator.mo").is_file():
        say(f"actuator {written.name}.Actuator between pins and flanges, example {written.name}.ActuatorExample")
    for line in actuator_told(loaded, sheet or None):
        say(line)
    say(f"the package needs the library HystFMU in {shipped_library()}")


def _stepped(model: "hy.Model", step: float) -> "hy.Model":
    """Return a model that had no sample period with the sample period `step` (s)."""
    if model.step is not None:
        raise InputError(f"--step must not be given: the model has a step of {model.step:g} s")
    if not 0 < step < float("inf"):
        raise InputError(f"--step must be a number of seconds above 0. Got {step:g} instead.")
    return replace(model, step=step)


def _wrote(path: Path, how: Mapping[str, Any]) -> None:
    say(f"wrote {path}: FMI {how['fmi']}.0, {path.stat().st_size // 1024} kB")
    if how["source"]:
        say(f"the C source is one C99 file; it needs fmi{how['fmi']}Functions.h of the FMI standard and the C library")


def _controller(scenario: str, case: str | None, target: str | None, how: Mapping[str, Any]) -> None:
    """Write the controller of a case, and print the units that it contains."""
    from hystfmu.fmu.write.export import export_fmu
    from hystfmu.report.terminal import table
    from hystfmu.scenario import Cases
    from hystfmu.scenario.deploy import controller, write_target

    if how["path"] is None and target is None:
        raise InputError("export --controller needs -o X.fmu, --c DIR, or both")
    chosen = Cases(found([scenario])[0]).named(case)
    with together():
        if target is not None:
            files, made = write_target(chosen, target, how["name"])
        if how["path"] is not None:
            made = controller(chosen)
            path = export_fmu(made.model, **how)
    if target is not None:
        say(f"wrote {' and '.join(map(str, files))}: C99, {files[0].stem}_start and {files[0].stem}_step")
    if how["path"] is not None:
        _wrote(path, how)
    say(f"included units: {', '.join(made.units)}; omitted units: {', '.join(made.left_out)}")
    ports = [p for p in made.model.graph.ports if p.kind in ("input", "output")]
    rows = [[p.name, p.kind, "" if p.unit == "1" else p.unit, p.text] for p in ports]
    say(table(["port", "", "unit of measure", "meaning"], rows))
    say(f"sample time: {made.model.step:g} s")


def _block(name: str, values: Mapping[str, Any]) -> "Block":
    """Return the block `name` with the given sizes and parameter values."""
    import hystfmu as hy
    from hystfmu.graph.node import block_type

    made: Block = getattr(hy.blocks, block_type(name).class_name)(**values)
    return made


@click.command(cls=Command)
@click.argument("scenario", type=FILE)
@of("", out=("-o --out X.ssp|X.fmu", {"required": True}), name="--case NAME")
@of("scenario.ssp.write:write_ssp", version="--ssp", fmi="", system_connectors="--connectors", separate="")
@of("", tolerance="PERCENT")
def ssp(
    scenario: str,
    out: WrittenFile,
    name: str | None,
    fmi: Literal[2, 3],
    version: Any,
    tolerance: float = 0.1,
    **how: Any,
) -> None:
    """Export a scenario as an SSP archive or one FMU.

    Other simulators can run the archive. 'hystfmu simulate X.ssp' runs archives of any origin.

    Other simulators step all components at the same time: the inputs of a component are the outputs that the other
    components had after the previous step. Therefore the command combines neighbouring units to one component, in which
    the units run in the order of the scenario. For each recorded output, the command prints the largest difference
    between the archive and the scenario. If a difference exceeds --tolerance, the command writes the archive, but the
    exit status is 1.

    With -o X.fmu, the command exports the whole loop as one FMU. All units in this FMU run in the order of the
    scenario.

    \b
    Example: hystfmu ssp scenarios/pid --case sine_10 -o pid.ssp
    \f

    Parameters
    ----------
    out : str
        SSP archive or FMU to write.
    name : str, optional
        Case of the scenario to export [default: the first case].
    tolerance : float in [0, inf)
        Largest accepted difference between archive and scenario, relative to the span of each recorded output.
    """
    from hystfmu.scenario import Cases
    from hystfmu.scenario.ssp.write import write_loop, write_ssp

    case = Cases(found([scenario])[0]).named(name)
    if out.endswith(".fmu"):
        path = write_loop(case, out, fmi)
        say(f"{path}: FMI {fmi}.0, case {case.name}, {len(case.units)} units in one FMU, step {case.step:g} s")
        return
    written = write_ssp(case, out, version, fmi=fmi, **how)
    made = f"{len(case.units)} units in {written.components} component{'s' if written.components > 1 else ''}"
    say(f"{out}: SSP {version}, case {case.name}, {made}, step {case.step:g} s")
    listed = ", ".join(f"{name} {value:.2g} %" for name, value in written.differences.items())
    say(f"largest difference from the scenario, in percent of the span: {listed}")
    if max(written.differences.values()) > 1e-6:
        late = "values reach other components one step late; " if written.components > 1 else ""
        say(f"reason: {late}other importers have no events within a step and no finer steps")
    if worse := [f"{name} differs by {x:.2g} %" for name, x in written.differences.items() if not x <= tolerance]:
        echo(
            f"{out}: does not reproduce the scenario within {tolerance:g} % of the span: {', '.join(worse)};"
            " the command has written the file in spite of this"
        )
        answer(None, False)


class _Of(click.Option):
    """An option for one kind of file, .fmu or .ssp. The help lists the option in a separate section for this kind.

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
@of(_RUN_FMU, settings="--set", step="", stop="")
@of(RUN, seconds="--timeout", confined="")
@of(_RUN_FMU, out=("-o --out OUT.csv", {"type": OUTPUT_FILE}))
@json_option
@of(_RUN_FMU, given=("--input IN.csv", {"type": FILE, "cls": _Of, "of": "fmu"}))
@of(RUN, engine=("", {"cls": _Of, "of": "ssp"}), coupling=("", {"cls": _Of, "of": "ssp"}))
@click.pass_context
def simulate(
    context: click.Context,
    /,
    file: str,
    given: str | None,
    engine: Literal["fmpy", "native"],
    coupling: Literal["gauss_seidel", "jacobi", "iterative"] | None,
    **how: Any,
) -> None:
    """Simulate an FMU or an SSP archive of any origin.

    The FMU may have FMI version 1.0, 2.0 or 3.0. If the FMU supports Co-Simulation, the command uses this interface.
    Otherwise the command uses Model Exchange with an adaptive integrator. Inputs are constant during a communication
    step. The option --input names a table of inputs for an FMU. Continuous inputs are interpolated between two rows of
    this table.

    An archive can contain a reference result. If step, coupling and parameter values are those of the archive, the
    command compares the simulated result with the reference result. The exit status is 1 if the two results differ.

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
    if kind == "fmu":
        from hystfmu.scenario.run_fmu import run_fmu

        done = run_fmu(file, given, **how)
        say("\n".join(done.lines()))
        answer(done.summary())
    from hystfmu.scenario.ssp.read import run_ssp

    with progress("simulating") as report:
        ran = run_ssp(file, engine, coupling, progress=report, **how)
    if ran.ignored:
        named = ", ".join(ran.ignored)[:200]
        echo(f"warning: {file}: These parameters have no effect, because no variable has their name: {named}", err=True)
    (say if ran.passed else echo)("\n".join(ran.lines()))
    answer(ran.summary(), ran.passed)


@click.command(cls=Command)
@click.argument("fmu", type=FILE)
@of("fmu.check.check:validate", seconds="", confined="")
@json_option
def validate(fmu: str, **how: Any) -> None:
    """Check an FMU of any origin, of FMI 1.0, 2.0 or 3.0.

    The command checks the zip archive, applies the static checks of fmpy and fmutool, and runs the FMU in a child
    process.

    The trial runs in this process execute the native code of the FMU. They check start values, repeatability, side
    effects of get and set, reset, saved states, two instances, dependencies, directional derivatives, memory leaks, and
    folders with spaces in their names.

    \b
    Example: hystfmu validate piezo.fmu
    """
    import hystfmu as hy
    from hystfmu.report.terminal import progress, table

    with progress("checking") as report:
        problems = hy.validate(fmu, progress=report, **how)
    timed, n = level() == VERBOSE, len(problems.checks)
    rows = [[c.name, c.tried or "does not apply", c.problems, *[f"{c.seconds:.2f}"] * timed] for c in problems.checks]
    say(table(["check", "tried", "problems", *["seconds"] * timed], rows) + "\n")
    for p in problems:
        echo(p)
    say(f"{fmu}: {len(problems)} problem{'' if len(problems) == 1 else 's'} in {n} check{'' if n == 1 else 's'}")
    answer({"file": fmu, "problems": problems, "checks": [asdict(c) for c in problems.checks]}, not problems)
