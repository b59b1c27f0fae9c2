"""The steps of `hystfmu start`: fit, invert, tune, simulate, export, report.

A study file is also written. The study simulates the loop with random devices similar to the fitted model, and computes
the share of devices with which the loop meets the limits.
"""

import re
import shlex
import shutil
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import hystfmu as hy
from hystfmu.base import InputError, write_toml
from hystfmu.base.steps import Steps
from hystfmu.data import Dataset
from hystfmu.design.plants import LEAST_SPREAD, LESS_DAMPED, SIGMAS
from hystfmu.face.interval import with_interval
from hystfmu.face.model import Model
from hystfmu.identify.auto import REFUSED
from hystfmu.identify.evidence import Evidence
from hystfmu.start.closed_loop import ClosedLoop, close
from hystfmu.start.device import DYNAMICS_NAME, Device, reference_frequency, unsuited
from hystfmu.start.excitation import write_excitation
from hystfmu.start.loop import GAIN
from hystfmu.start.page import verdict, write_page, write_verdict
from hystfmu.start.promise import FAR, SLIGHT
from hystfmu.start.requirements import Requirements

WIDTH = 0.1  # by which thresholds differ; gain and modes as in the draws of the loop
DRAWS = 200


def write_study(path: Path, loop: ClosedLoop, scenario: str, name: str) -> bool:
    """Write a study file with random devices; return False if the model has no parameter that can vary.

    `scenario` is the name of the scenario folder, which is in the same folder as the file. The limit for each random
    device is the largest limit of the cases with other devices in the scenario.
    """
    parameters = drawn(loop.device)
    limits = [r.system.case.metrics["tracking"].limit for r in loop.results if r.case not in loop.references]
    known = [v for v in limits if v is not None]
    if not parameters or not known:
        return False
    case = loop.promises[0].name
    content = {
        "name": f"{name}_devices",
        "text": "share of bounded loops on devices with random gain, dynamics and loop width around those of the model",
        "scenario": scenario,
        "cases": [case],
        "method": "random",
        "n": DRAWS,
        "seed": "run",
        "limits": {case: {"tracking": max(known)}},
        "parameters": parameters,
    }
    write_toml(path, content, f"Devices around the fitted model: {_line('study', path, '-o', path.parent / 'devices')}")
    return True


def drawn(found: Device) -> dict[str, dict[str, Any]]:
    """Return the varied parameters of the study with their ranges.

    These parameters are gain, natural frequency, damping ratio and width of the hysteresis loops, if the model has
    them.
    """
    graph = found.model.graph
    ranges: dict[str, dict[str, Any]] = {}
    if len(found.plant.f_n) == 1:
        (f_n,), (zeta,), ((f_se, _, _),) = found.plant.f_n, found.plant.zeta, found.errors
        ranges[f"plant.{DYNAMICS_NAME}"] = {
            "second_order": {
                "gain": _around(1.0, GAIN),
                "f_n": _around(f_n, max(SIGMAS * f_se / f_n, LEAST_SPREAD)),
                "zeta": _around(zeta, 1 - LESS_DAMPED),
            }
        }
    last = graph.node(graph.outputs[0].source.split(".")[0])
    if not ranges and last.type == "scaling" and last.dims == {"n": 1}:
        ranges[f"plant.{last.name}_gain"] = {"scale": _around(1.0, GAIN)}
    for n in graph.nodes:
        if n.block.rate == "hysteretic" and any(v.name == "r" for v in n.block.parameters):
            ranges[f"plant.{n.name}_r"] = {"scale": _around(1.0, WIDTH)}
    return ranges


def _around(value: float, share: float) -> list[float]:
    return [float(f"{value * (1 + sign * share):.6g}") for sign in (-1, 1)]


CARRIED = 0.2  # of the sampling rate: a sine with five rows in a period
SEEN = 2.0  # times what the record shows
FASTER = 10.0  # times the bandwidth that is asked for: where a resonance matters
NOTHING = Requirements()
_OPTION = re.compile(r"(\w+)=(\S+)")


@dataclass(frozen=True)
class Started:
    """Result of `start`."""

    model: Model
    loop: ClosedLoop | str  # the loop with the inverse of the model, or the reason why there is none
    verdict: dict[str, Any]  # content of verdict.json, see verdict.schema.json in this folder
    files: dict[str, tuple[Path, str]]  # path of each file or folder, and the command that creates it
    notes: list[str]  # notes on decisions

    @property
    def approved(self) -> bool:
        """True if there is a loop that meets the requirements."""
        return bool(self.verdict["approved"])


def _unseen(step: str) -> AbstractContextManager[Callable[[float], None]]:
    """Return a context manager whose progress function shows nothing."""
    return nullcontext(lambda fraction: None)


def start(
    data: Dataset,
    folder: Path,
    asked: Requirements = NOTHING,
    key: str = "auto",
    seed: int = 0,
    source: Sequence[str] = ("DATA",),
    told: Callable[[str], None] = lambda line: None,
    shown: Callable[[str], AbstractContextManager[Callable[[float], None]]] = _unseen,
    **options: Any,
) -> Started:
    """Create model, inverse, loop, FMUs and report from one record.

    Parameters
    ----------
    data : Dataset
        Record with a measured output.
    folder : Path
        Folder for all files.
    asked : Requirements
        Requirements of the loop.
    key : str
        Kind of model. ``"auto"`` compares several kinds of model that have an inverse, and selects the best one.
    seed : int
        Seed of the random start values of the fit.
    source : sequence of str
        Arguments of the command line that specify the data file and its columns.
    told : function
        Called with a line of text at the end of each step.
    shown : function
        Called with the name of a long step. It returns a context manager that yields a function. This function is
        called with the completed fraction, 0 to 1.
    **options
        Options of the kind of model.

    Raises
    ------
    InputError
        The data have covariates, no kind of model represents the data, the kind or an option is unknown, or the folder
        cannot be written.
    """
    if data.covariates:
        raise InputError(
            f"{data.path or data.name}: The record of a loop must have one input. Got the covariates "
            f"{', '.join(data.covariates.names)}: leave them out, or fit a model with them by `hystfmu fit`."
        )
    name = re.sub(r"\W", "_", data.stem)
    name = name if name[:1].isalpha() else f"device_{name}"
    file, steps = folder / f"{name}.model.toml", Steps(folder)
    fit = [key, seed, *options.items()]
    steps.claim(data.sha256, data.name, data.train.start, data.train.stop, *fit, removed=_of_a_loop(folder, name))

    def fitted() -> tuple[str, list[str]]:
        with shown("fitting") as progress:
            model, why, notes = _model(data, key, seed, progress, options)
            with_interval(model, data).save(file)
        return why, notes

    why, notes = steps.run("fit", [*data.identity, *fit], [file], fitted)
    model = Model.load(file)
    told(_fitted(model) + (", from the run before" if steps.kept else ""))
    words = [*source, *_fit_words(model, key, seed, "model" if why else "inverse", options)]
    files = _files_of_model(folder, name, model, words)
    for old in _of_a_loop(folder, name):  # delete files of an earlier run: they do not belong to the new verdict
        shutil.rmtree(old) if old.is_dir() else old.unlink(missing_ok=True)
    loop: ClosedLoop | str = why
    if not why:
        try:
            loop = close(model, data, folder / "loop", name, asked, told, shown)
        except InputError as e:  # keep the model: its fit may have taken long
            shutil.rmtree(folder / "loop", ignore_errors=True)
            loop = str(e)
    report = f"{files['model'][1]} --report {shlex.quote(str(folder))}"
    if isinstance(loop, ClosedLoop):
        files |= _files_of_loop(folder, name, model, loop)
        report = f"{_line('run', folder / 'loop')} --report DIR"
    doubt = isinstance(loop, ClosedLoop) and loop.feedback != "full" and asked.controller != "none"
    if model.fit.get("warnings") or doubt:
        notes = [*notes, _measure_next(folder / "measure_next.csv", data, asked, model, key)]
        files["next measurement"] = (folder / "measure_next.csv", "written by hystfmu start alone")
    said = verdict(loop)
    with shown("report"):
        files["report"] = (write_page(folder, name, model, data, loop, said, notes), report)
    files["verdict"] = (write_verdict(folder, said), "written by hystfmu start alone")
    steps.made([*dict.fromkeys([*(path for path, _ in files.values()), *_of_a_loop(folder, name)])])
    return Started(model, loop, said, files, notes)


def _of_a_loop(folder: Path, name: str) -> list[Path]:
    """Return the paths of the files that this command writes for a loop."""
    inverse = [f"{name}_inverse.model.toml", f"{name}_inverse.fmu", f"{name}_controller.fmu"]
    return [folder / n for n in ("loop", "devices.study.toml", "report.json", "measure_next.csv", *inverse)]


def _measure_next(path: Path, data: Dataset, asked: Requirements, model: Model, key: str) -> str:
    """Write the input for the next measurement, and return a note about it.

    The note also states if the model misses the recorded rows themselves: more rows cannot reduce this error.
    """
    top = float(model.fit["evidence"]["band"][1])
    up_to = max(CARRIED / data.h, FASTER * (asked.bandwidth or 0.0), SEEN * top)
    note = f"measure next: {path.name}, {write_excitation(path, data, reference_frequency(data), up_to, model)}"
    error, noise = float(model.fit["rms_percent"]), 100 * Evidence.from_dict(model.fit["evidence"]).noise / data.span
    if error <= max(SLIGHT, FAR * noise):  # the noise may be NaN
        return note
    other = "" if key == "auto" else "another kind of model or "
    note += f"; this cannot reduce the error of {error:.3g} % of the span on this record (noise {noise:.2g} %)"
    return f"{note}: this needs {other}further measured inputs, such as a temperature"


def _model(
    data: Dataset, key: Any, seed: int, progress: Callable[[float], None], options: dict[str, Any]
) -> tuple[Model, str, list[str]]:
    """Return a model, the reason why it cannot be used in a loop (or ""), and notes.

    A note states that another model has a smaller error but cannot be used in a loop.
    """
    try:
        best = hy.fit(data, key, seed=seed, progress=progress, purpose="inverse", **options)
    except InputError as e:
        why = str(e) if key == "auto" else f"{e} Without --model, the command selects a kind that has an inverse."
        return hy.fit(data, key, seed=seed, progress=progress, **options), why, []
    fault = unsuited(best)
    if not fault:
        return best, "", []
    ranking = best.provenance.get("auto", {})
    for candidate in [name for name, error in ranking.items() if error <= REFUSED][1:]:
        kind, its = candidate.partition(" ")[0], {k: _value(v) for k, v in _OPTION.findall(candidate)}
        with suppress(InputError):
            model = hy.fit(data, kind, seed=seed, purpose="inverse", **its)
            if not unsuited(model):
                return model, "", [f"{fault} The loop has {candidate} instead, {ranking[candidate]:.3g} %FS."]
    return best, fault, []


def _value(text: str) -> Any:
    for kind in (int, float):
        with suppress(ValueError):
            return kind(text)
    return text


def _fit_words(model: Model, key: str, seed: int, purpose: str, options: dict[str, Any]) -> list[str]:
    """Return the options with which `hystfmu fit` produces the model."""
    if key == "auto" and "auto" not in model.provenance:
        options = model.provenance.get("options", {})
    words = ["--for", purpose] if key == "auto" and not options else ["--model", model.key]
    words += [w for k, v in options.items() for w in ("--set", f"{k}={v}")]
    return words + (["--seed", str(seed)] if seed else [])


def _fitted(model: Model) -> str:
    found = model.fit
    held = found.get("held_out_rms_percent", found.get("validation_percent"))
    of = "" if held is None else f", {held:.3g} %FS on validation rows"
    return f"model: {model.key}, RMS {found['rms_percent']:.3g} %FS on training rows{of}"


def _line(*words: str | Path) -> str:
    """Return a command line of hystfmu for a shell."""
    return shlex.join(["hystfmu", *map(str, words)])


def _files_of_model(folder: Path, name: str, model: Model, fitting: Sequence[str]) -> dict[str, tuple[Path, str]]:
    """Write the FMU of a model, and return the files of the model with the commands that create them."""
    file = folder / f"{name}.model.toml"
    made = model.export(folder / f"{name}.fmu", name=name)  # the command names an FMU after its model file
    return {
        "model": (file, _line("fit", *fitting, "-o", file)),
        "FMU of the model": (made, _line("export", file, "-o", made)),
    }


def _files_of_loop(folder: Path, name: str, model: Model, loop: ClosedLoop) -> dict[str, tuple[Path, str]]:
    """Write the inverse, the FMUs of inverse and controller, and a study.

    Return the files of the loop with the commands that create or use them.
    """
    file, back, into = folder / f"{name}.model.toml", folder / f"{name}_inverse.model.toml", folder / "loop"
    inverse = model.inverse()
    inverse.save(back)
    made = inverse.export(folder / f"{name}_inverse.fmu", name=f"{name}_inverse")
    deployed = hy.Scenario.load(into).export_controller(folder / f"{name}_controller.fmu")
    study, drawn = folder / "devices.study.toml", folder / "devices"
    written = write_study(study, loop, into.name, name)
    return {
        "inverse": (back, _line("inverse", file, "-o", back)),
        "FMU of the inverse": (made, _line("export", back, "-o", made)),
        "loop": (into, f"{_line('run', into)}; {_line('margins', into)}"),
        "FMU of the controller": (deployed, _line("export", into, "--controller", "-o", deployed)),
        **({"study of random devices": (study, _line("study", study, "-o", drawn))} if written else {}),
    }
