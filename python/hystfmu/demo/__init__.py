"""The command `hystfmu demo` runs the whole workflow on built-in data, from the record to the report."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hystfmu.base.steps import Steps
from hystfmu.data import Dataset
from hystfmu.data.signals import held_out
from hystfmu.data.synthetic import VOLTS, displacement, piezo
from hystfmu.face.fit import fit
from hystfmu.face.model import Model
from hystfmu.face.page import explorer
from hystfmu.face.scenario import Scenario
from hystfmu.fmu.check.check import validate
from hystfmu.graph.blocks import Delay, Noise, Pid, Sum
from hystfmu.identify.kinds import Kind
from hystfmu.model.accuracy import held_out_table
from hystfmu.report import terminal
from hystfmu.report.page import Section, Table
from hystfmu.report.plot import Line, Plot
from hystfmu.report.terminal import echo, progress, say, table, wrong
from hystfmu.scenario import run
from hystfmu.scenario.report.cases import compared
from hystfmu.scenario.report.page import write_report
from hystfmu.scenario.report.terminal import verdicts
from hystfmu.scenario.system.spec import shipped_scenarios

SHARE = 0.1  # of an error that one step of the integral takes away: far below what the delay of the loop allows
CORNERS: dict[
    str, tuple[str, dict[str, Any], float]
] = {  # text, what differs from the identified device, limit of the RMS error in % of the stroke
    "nominal": ("the identified device", {}, 0.02),
    "wider": ("hysteresis wider by 20 %", {"plant.hysteresis_w": "*1.2"}, 0.5),
    "narrower": ("hysteresis narrower by 20 %", {"plant.hysteresis_w": "*0.8"}, 0.5),
    "stronger": ("stroke larger by 10 %", {"plant.readout_gain": "*1.1"}, 0.5),
    "weaker": ("stroke smaller by 10 %", {"plant.readout_gain": "*0.9"}, 0.5),
    "creeping": ("twice the creep", {"plant.creep_w": "*2"}, 0.1),
    "noisy": ("sensor noise of 20 nm RMS", {"noise.sigma": 0.02}, 0.05),
}


def loop(model: Model, inverse: Model) -> Scenario:
    """Return the scenario of the demo, with a sine over 80 % of the stroke as reference and seven cases.

    Parameters
    ----------
    model : Model
        Model of the kind `actuator`. The sample period of the model is the time step of the loop.
    inverse : Model
        Inverse of `model`. The output of the model lags the input of the inverse by some steps. Therefore the loop
        compares the output with a reference that is delayed by these steps.
    """
    h = float(model.step or 1e-3)
    late = 1 + int(inverse.fit.get("lag_steps", 0))  # the command acts in the next step
    made = Scenario("loop", step=h, text="inverse and integral feedback")
    made.add("plant", model, fine=True).add("noise", Noise(sigma=0.0)).add("sensor", Sum(n=2))
    made.add("wanted", Delay(n=late)).add("pid", Pid(Kp=0.0, Ki=SHARE / h)).add("inverse", inverse)
    made.connect("plant.y", "sensor.u_1").connect("noise.w", "sensor.u_2").connect("sensor.y", "pid.y")
    made.connect("reference.r", "wanted.u").connect("wanted.y", "pid.y_d").connect("reference.r", "pid.u_ff")
    made.connect("pid.u", "inverse.u").connect("inverse.y", "plant.u")
    made.metric(
        "tracking", "rms_percent", "plant.y", against="wanted.y", text="RMS error of the displacement, % of the stroke"
    )
    made.loop("wanted.y", "plant.y").loop("inverse.y", "plant.y")
    for name, (text, different, limit) in CORNERS.items():
        made.case(name, text, set=different, limits={"tracking": limit})
    return made.margins(case="nominal", Ms_db=6.0)


KEYS: tuple[Kind, ...] = (  # the first is the model of the short demonstration: no other one errs less
    "actuator",
    "prandtl_ishlinskii",
    "zhao_tan_mlp",
    "play_bank_mlp",
    "bouc_wen",
)
VERSIONS: tuple[Literal[2, 3], ...] = (2, 3)  # of FMI
MOST_SHOWN, MOST_POINTS = 4000, 1000  # rows of a diagram, points of a loop
EXPLORED = "The models of the FMUs run in this page. You can add the inverse in front if it is exact or implicit."
HEAD = ("model", "parameters", "nested RMS %FS", "worst RMS %FS", "worst max %FS", "seconds")


def demo(out: Path, full: bool = False) -> bool:
    """Run the whole workflow on built-in data, and write all results to the folder `out`.

    Parameters
    ----------
    out : Path
        Folder for data, models, FMUs, Modelica package, loop and report.
    full : bool
        Whether to fit five kinds of model instead of one and run all scenarios that HystFMU ships.

    Returns
    -------
    bool
        True if no FMU has problems and every loop meets its limits.

    Raises
    ------
    InputError
        `out` cannot be written, or the package is installed without its scenarios.
    """
    keys = KEYS if full else KEYS[:1]
    shipped = sorted(p.parent for p in shipped_scenarios().glob("*/scenario.toml")) if full else []
    train, other = piezo(seed=0), piezo(seed=1000)
    steps = Steps(out)
    steps.claim("demo", full)
    train.to_csv(out / "piezo.csv")
    other.to_csv(out / "piezo_held_out.csv")
    say(f"Synthetic piezo stack: {len(train.t)} rows at {1 / train.h:g} Hz, 0..100 V, {train.span:.1f} um.")
    say(terminal.loop(train.u, train.y, "displacement (um) over voltage (V)"))

    models = [_fit(steps, out, train, key) for key in keys]
    rows = [_row(m, train) for m in models]
    say("\nErrors on held-out signals, in percent of the span of the training data: nested reversals, and the worst of")
    say("other decays, two tones, nested reversals and minor loops.\n")
    say(table(HEAD, rows))

    if steps.kept:
        say(f"\nfrom the run before: {', '.join(steps.kept)}")
    inverse = models[0].inverse()
    problems, n_fmus = _export(steps, [*models, inverse], out)
    package = models[0].export_modelica(out / "modelica" / "Piezo", f"{models[0].key}.model.toml")
    own = loop(models[0], inverse)
    own.save(out / "loop")
    with progress("running scenarios") as report:
        results = run([own, *shipped], progress=report)
    say("\n" + verdicts(results))
    wrong([line for r in results for line in r.failures()])
    page = write_report(results, out, _sections(models, inverse, rows, other), "HystFMU demo")
    made = ("piezo.csv", "piezo_held_out.csv", "models", "fmus", "modelica", "loop", "report.json")
    steps.made([*(out / name for name in made), page])
    say(f"\nwrote to {out}/: models, {n_fmus} FMUs, the Modelica package {package.name}, the closed loop in loop/")
    say(f"open {page}; for a record of yours: hystfmu start DATA.csv")
    return not problems and all(r.passed for r in results)


def _fit(steps: Steps, out: Path, train: Dataset, key: Kind) -> Model:
    path = _file(out, key)

    def fitted() -> None:
        with progress(f"fitting {key}") as report:
            fit(train, key, progress=report).save(path)

    steps.run(f"fit of {key}", train.identity, [path], fitted)
    return Model.load(path)


def _file(out: Path, name: str) -> Path:
    return out / "models" / f"{name}.model.toml"


def _row(m: Model, train: Dataset) -> list[str]:
    volts = {name: VOLTS / 2 * (1 + x) for name, x in held_out().items()}
    found = held_out_table(m, lambda u: displacement(u, train.h), train.span, volts)
    worst = (max(e[k] for e in found.values()) for k in ("rms_percent", "max_percent"))
    percent = [f"{e:.3f}" for e in (found["nested reversals"]["rms_percent"], *worst)]
    return [m.key, str(m.fit["parameters"]), *percent, f"{m.fit['seconds']:.2f}"]


def _export(steps: Steps, models: Sequence[Model], out: Path) -> tuple[list[str], int]:
    """Write the models and their FMUs for both versions of FMI.

    Return the problems that the checks of the FMUs find, and the number of FMUs.
    """
    made = {}
    for m in models:
        m.save(_file(out, m.key))
        source = _file(out, m.key).read_text(encoding="utf-8")
        for version in VERSIONS:
            path = out / "fmus" / f"{m.key}_fmi{version}.fmu"
            made[path] = partial(
                steps.run, f"check of {path.name}", [source], [path], partial(_checked, m, path, version)
            )
    problems = []
    with progress("checking FMUs") as report, ThreadPoolExecutor(2) as pool:  # each is checked in a process of its own
        for k, (path, found) in enumerate(zip(made, pool.map(lambda run: run(), made.values()), strict=True)):
            problems += [f"{path}: {p}" for p in found]
            report((k + 1) / len(made))
    say(f"\n{len(made)} FMUs written and checked: {len(problems)} problems")
    for p in problems:
        echo(p)
    return problems, len(made)


def _checked(m: Model, path: Path, version: Literal[2, 3]) -> list[str]:
    """Write an FMU, and return the problems that the checks find."""
    return [str(p) for p in validate(m.export(path, version, m.key))]


def _sections(models: list[Model], inverse: Model, rows: list[list[str]], data: Dataset) -> list[Section]:
    """Return the first sections of the report: plots without and with the inverse, models, explorer."""
    wanted = models[0].predict(data.u, data.h)  # a displacement that the actuator can follow
    slope, offset = np.polyfit(data.y, data.u, 1).tolist()
    before = displacement(slope * wanted + offset, data.h)
    after = displacement(inverse.predict(wanted, data.h), data.h)
    late = int(inverse.fit.get("lag_steps", 0))  # an inverse of dynamics needs the reference so many steps ahead
    wanted = wanted[: len(wanted) - late]
    reached = {"before: a gain alone": before[: len(wanted)], f"after: the inverse of {models[0].key}": after[late:]}
    errors = [100 * float(np.sqrt(np.mean((v - wanted) ** 2))) / data.span for v in reached.values()]
    shown = slice(0, MOST_SHOWN)
    shown_of = {title: (data.t[shown], wanted[shown], v[shown]) for title, v in reached.items()}
    plots = compared(shown_of, " (um)", MOST_POINTS)
    held_out = [Line(m.key, data.t[shown], (m.predict(data.u, data.h) - data.y)[shown]) for m in models[:3]]
    error = Plot("error on the held-out record", "time (s)", "error (um)", held_out, envelope=True)
    answer = f"The inverse of a model brings the RMS error from {errors[0]:.3g} to {errors[1]:.3g} % of the stroke."
    text = (
        "Models are fitted to piezo.csv, the built-in piezo stack. The diagram shows piezo_held_out.csv, which has "
        "other random reversals. Errors on nested reversals and worst errors on held-out signals are in percent of the "
        "span of the training data."
    )
    return [
        Section("", answer, plots=plots),
        Section("Models", text, [Table(HEAD, rows)], [error]),
        Section("Explorer", EXPLORED, explorer=explorer(models, data, "voltage (V)", "displacement (um)")),
    ]
