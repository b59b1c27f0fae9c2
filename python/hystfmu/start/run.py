"""The steps of `hystfmu start`: read, fit, invert, tune, run, export, report."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.face.fit_page import fit_sections
from hystfmu.face.model import Model
from hystfmu.face.result import Results
from hystfmu.report.page import Section, Table
from hystfmu.report.plot import LOOP_POINTS, Line, Plot
from hystfmu.scenario.margin_table import MarginTable, margin_table
from hystfmu.scenario.report.page import write_report
from hystfmu.start.device import FREQUENCY, Device, device, faster, unsuited
from hystfmu.start.excitation import write_excitation
from hystfmu.start.loop import COMPUTING, loop_scenario
from hystfmu.start.tuning import Gains, tune

OTHER = "prandtl_ishlinskii"  # stands for the plant in one case: fitted in closed form to any record
_OPTION = re.compile(r"(\w+)=(\S+)")


@dataclass(frozen=True)
class Started:
    """What `start` made.

    Attributes
    ----------
    model, inverse : Model
    device : Device
    gains : Gains
    results : Results
        Of the cases of the scenario.
    margins : MarginTable
    files : dict of str to (Path, str)
        Each file or folder, with the command that makes it alone.
    notes : tuple of str
        What was decided on the way.
    """

    model: Model
    inverse: Model
    device: Device
    gains: Gains
    results: Results
    margins: MarginTable
    files: dict[str, tuple[Path, str]]
    notes: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether all cases meet what is asked for, and the loop its margins."""
        return self.results.passed and not self.margins.broken()


def _unseen(step: str) -> AbstractContextManager[Callable[[float], None]]:
    """Show nothing."""
    return nullcontext(lambda fraction: None)


def start(
    data: Dataset,
    folder: Path,
    percent: float = 1.0,
    key: str = "auto",
    seed: int = 0,
    source: Sequence[str] = ("DATA",),
    told: Callable[[str], None] = lambda line: None,
    shown: Callable[[str], AbstractContextManager[Callable[[float], None]]] = _unseen,
) -> Started:
    """Make everything from one record.

    Parameters
    ----------
    data : Dataset
        With a measured output.
    folder : Path
        To write into.
    percent : float
        Largest RMS error of the loop that is asked for, in percent of the stroke.
    key : str
        Kind of model; ``"auto"`` chooses among those that have an inverse.
    seed : int
        Seed of the fit.
    source : sequence of str
        Words that read the data on a command line.
    told : function
        Called with a line where a step ends.
    shown : function
        Called with the name of a step that takes long; gives a context with a function of the fraction done.

    Raises
    ------
    InputError
        No kind of model follows the data and has an inverse, the named kind does not fit into a loop, or the folder
        cannot be written.
    """
    name = re.sub(r"\W", "_", data.name.partition(" ")[0])
    name = name if name[:1].isalpha() else f"device_{name}"
    with shown("fitting") as progress:
        model, notes = _model(data, key, seed, progress)
    found = device(model, data)
    told(_fitted(model))
    inverse = model.inverse()
    model.save(folder / f"{name}.model.toml")
    inverse.save(folder / f"{name}_inverse.model.toml")
    with shown("tuning"):
        gains = _gains(found)
    told(f"loop: Kp = {gains.Kp:g}, Ki = {gains.Ki:g} 1/s, step {found.h:g} s, Ms {gains.Ms_db:.1f} dB")
    scenario = loop_scenario(found, gains, percent, name, _other(model, data))
    into = scenario.save(folder / "loop")
    with shown("running the loop") as progress:
        results = hy.run(into, engine="native", record=True, progress=progress)
    with shown("margins") as progress:
        margins = margin_table([into], progress=progress)
    files = _exported(folder, name, model, inverse, [*source, *_fit_words(model, key, seed)])
    if model.fit.get("warnings"):
        write_excitation(folder / "measure_next.csv", data, found.frequency)
        files["next measurement"] = (folder / "measure_next.csv", "written because of the warnings")
    with shown("report"):
        sections = [_hero(results, data), *fit_sections(model, data), _controller(gains, margins, notes)]
        page = write_report(results, folder, sections, f"{name}: model, inverse, loop")
    files["report"] = (page, f"hystfmu run {into} --report DIR")
    return Started(model, inverse, found, gains, results, margins, files, notes)


def _model(data: Dataset, key: str, seed: int, progress: Callable[[float], None]) -> tuple[Model, tuple[str, ...]]:
    """Return the best model that fits into a loop, and a line if it is not the best of all."""
    best = hy.fit(data, key, seed=seed, progress=progress, purpose="inverse")
    fault = unsuited(best)
    if not fault:
        return best, ()
    ranking = best.provenance.get("auto", {})
    for candidate in list(ranking)[1:]:
        kind, options = candidate.partition(" ")[0], {k: _value(v) for k, v in _OPTION.findall(candidate)}
        with suppress(InputError):
            model = hy.fit(data, kind, seed=seed, purpose="inverse", **options)
            if not unsuited(model):
                return model, (f"{fault} The loop has {candidate} instead, {ranking[candidate]:.3g} %FS.",)
    raise InputError(f"{data.path or data.name}: {fault}")


def _value(text: str) -> Any:
    for kind in (int, float):
        with suppress(ValueError):
            return kind(text)
    return text


def _fit_words(model: Model, key: str, seed: int) -> list[str]:
    """Return the options of `hystfmu fit` that give the model."""
    options = model.provenance.get("options", {}) if key == "auto" and "auto" not in model.provenance else {}
    words = ["--for", "inverse"] if key == "auto" and not options else ["--model", model.key]
    words += [w for k, v in options.items() for w in ("--set", f"{k}={v}")]
    return words + (["--seed", str(seed)] if seed else [])


def _fitted(model: Model) -> str:
    found = model.fit
    held = found.get("held_out_rms_percent", found.get("validation_percent"))
    of = "" if held is None else f", {held:.3g} %FS on validation rows"
    return f"model: {model.key}, RMS {found['rms_percent']:.3g} %FS on training rows{of}"


def _gains(found: Device) -> Gains:
    scaled = [tuple(faster(n, f) for n in found.dynamics) for f in (1 - FREQUENCY, 1 + FREQUENCY)]
    return tune([found.dynamics, *(scaled if found.dynamics else [])], found.h, found.delay + COMPUTING)


def _other(model: Model, data: Dataset) -> Model | None:
    """Return a model of another kind, which stands for a device that the model does not describe."""
    if model.key == OTHER:
        return None
    with suppress(InputError):
        return hy.fit(data, OTHER)
    return None


def _exported(
    folder: Path, name: str, model: Model, inverse: Model, fitting: Sequence[str]
) -> dict[str, tuple[Path, str]]:
    """Write the FMUs; return all files so far with their commands."""
    loop = folder / "loop"
    made = model.export(folder / f"{name}.fmu")
    other = inverse.export(folder / f"{name}_inverse.fmu")
    file, back = folder / f"{name}.model.toml", folder / f"{name}_inverse.model.toml"
    return {
        "model": (file, shlex.join(["hystfmu", "fit", *fitting, "-o", str(file)])),
        "inverse": (back, f"hystfmu inverse {file} -o {back}"),
        "FMU of the model": (made, f"hystfmu export {file} -o {made}"),
        "FMU of the inverse": (other, f"hystfmu export {back} -o {other}"),
        "loop": (loop, f"hystfmu run {loop}; hystfmu margins {loop}"),
    }


def _hero(results: Results, data: Dataset) -> Section:
    """Draw the device behind a gain alone, and in the loop."""
    shown = {"before: a gain alone": "neither", "after: inverse and feedback": "sine"}
    unit = f" ({data.unit_y})" if data.unit_y else ""
    plots, words = [], []
    for title, case in shown.items():
        found = next(r for r in results if r.case == case)
        if found.trace is None:
            continue
        signals = [found.trace["reference.r"], found.trace[found.system.case.metrics["tracking"].signal]]
        r, y = (v[len(v) // 2 :] for v in signals)
        plots.append(Plot(title, f"wanted{unit}", f"reached{unit}", [Line("reached", r, y)], points=LOOP_POINTS))
        words.append(f"{found.verdicts[0].value:.3g}")
    answer = (
        f"The RMS error of the loop is {words[-1]} % of the stroke; behind a gain alone it is {words[0]} %. "
        "The fitted model stands for the device here: what it misses, see Errors, comes on top."
    )
    return Section("", answer if len(words) == len(shown) else "", (), plots)


def _controller(gains: Gains, margins: MarginTable, notes: tuple[str, ...]) -> Section:
    limits = [[v.limit, "unstable" if v.value is None else v.value, v.bound, v.where, v.word] for v in margins.verdicts]
    return Section(
        "Controller",
        f"PI controller inside the inverse: Kp = {gains.Kp:g}, Ki = {gains.Ki:g} 1/s, the largest integral gain with "
        "Ms below 6 dB that is stable at all corners with a step of delay more (Astrom, Panagopoulos & Hagglund 1998).",
        [Table(("limit of the loop", "value", "bound", "at", "verdict"), limits)]
        + ([Table(("note",), [(n,) for n in notes])] if notes else []),
    )


__all__ = ["Started", "start"]
