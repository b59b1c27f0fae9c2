"""The page of `hystfmu start`: the device before and after, errors, explorer, controller; or why there is no loop."""

from __future__ import annotations

from pathlib import Path

from hystfmu.base.files import write_text
from hystfmu.data import Dataset
from hystfmu.face.fit_page import fit_page, fit_sections
from hystfmu.face.model import Model
from hystfmu.face.result import Results
from hystfmu.report.page import Section, Table
from hystfmu.report.plot import LOOP_POINTS, Line, Plot
from hystfmu.scenario.report.page import write_report
from hystfmu.start.closed_loop import ClosedLoop


def write_page(folder: Path, name: str, model: Model, data: Dataset, loop: ClosedLoop | str, notes: list[str]) -> Path:
    """Write report.html.

    Parameters
    ----------
    folder : Path
        To write into.
    name : str
        Of the device.
    model : Model
    data : Dataset
        Of the fit.
    loop : ClosedLoop or str
        The loop, or why there is none.
    notes : list of str
        What was decided on the way.

    Returns
    -------
    Path
        Of the page.
    """
    if isinstance(loop, str):
        path = folder / "report.html"
        write_text(path, fit_page(model, data, f"There is no loop: {loop}"))
        return path
    sections = [_before_and_after(loop.results, data), *fit_sections(model, data), _controller(loop, notes)]
    return write_report(loop.results, folder, sections, f"{name}: model, inverse, loop")


def _before_and_after(results: Results, data: Dataset) -> Section:
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


def _controller(loop: ClosedLoop, notes: list[str]) -> Section:
    gains, margins = loop.gains, loop.margins
    limits = [[v.limit, "unstable" if v.value is None else v.value, v.bound, v.where, v.word] for v in margins.verdicts]
    return Section(
        "Controller",
        f"PI controller inside the inverse: Kp = {gains.Kp:g}, Ki = {gains.Ki:g} 1/s, the largest integral gain with "
        "Ms below 6 dB that is stable at all corners with a step of delay more (Astrom, Panagopoulos & Hagglund 1998).",
        [Table(("limit of the loop", "value", "bound", "at", "verdict"), limits)]
        + ([Table(("note",), [(n,) for n in notes])] if notes else []),
    )
