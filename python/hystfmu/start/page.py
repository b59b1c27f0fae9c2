"""Writes the report of `hystfmu start`, with the verdict on the loop, plots, errors, explorer and controller.

If no loop could be built, the report states the reason.

Terminal, report, verdict.json and exit status state the same verdict.
"""

import json
from pathlib import Path
from typing import Any

from hystfmu.base import write_text
from hystfmu.data import Dataset
from hystfmu.face.model import Model
from hystfmu.face.page import fit_page, fit_sections
from hystfmu.report import page
from hystfmu.report.page import Section, Table
from hystfmu.report.plot import LOOP_POINTS
from hystfmu.scenario.report.cases import compared
from hystfmu.scenario.report.page import write_report
from hystfmu.start.closed_loop import ClosedLoop

OF_REFERENCE = "RMS %, at most %: in percent of the peak-to-peak value of the reference"
PROMISED = ("name", "shape", "frequency", "amplitude", "offset", "rms_percent", "bound_percent")


def verdict(loop: ClosedLoop | str) -> dict[str, Any]:
    """Return the content of verdict.json, as described by verdict.schema.json.

    Parameters
    ----------
    loop : ClosedLoop or str
        The loop, or the reason why no loop could be built.
    """
    if isinstance(loop, str):
        return {
            "approved": False,
            "feedback": "none",
            "controller": "none",
            "step": None,
            "reasons": [f"no loop: {loop}"],
            "references": [],
        }
    failed = [line for r in loop.results for line in r.failures()]
    return {
        "approved": loop.approved,
        "feedback": loop.feedback,
        "controller": loop.tuned.structure.name if loop.tuned else "none",
        "step": loop.device.h,
        "reasons": [*loop.misfitted, *failed, *loop.margins.broken(), *loop.reasons],
        "references": [
            {k: getattr(p, k) for k in PROMISED}
            | {"model_percent": p.model_percent if p.model_percent < float("inf") else None, "reason": p.why}
            for p in loop.promises
        ],
    }


def sentence(told: dict[str, Any]) -> str:
    """Return the verdict `told` as one line of text."""
    word = "approved" if told["approved"] else "not approved"
    with_ = {"full": "feedback", "slow": "slow feedback", "none": "no feedback"}[told["feedback"]]
    why = f": {told['reasons'][0]}" if not told["approved"] and told["reasons"] else ""
    return f"verdict: {word}, {with_}{why}"


def percent(value: float | None) -> str:
    """Return an error in percent as text with three digits, or "not known" for None."""
    return "not known" if value is None else page.percent(value)


def write_verdict(folder: Path, told: dict[str, Any]) -> Path:
    """Write verdict.json, and return the path of this file."""
    path = folder / "verdict.json"
    write_text(path, json.dumps(told, indent=1) + "\n")
    return path


def write_page(
    folder: Path, name: str, model: Model, data: Dataset, loop: ClosedLoop | str, told: dict[str, Any], notes: list[str]
) -> Path:
    """Write report.html, and return its path.

    `told` is the verdict. `loop` is the loop, or the reason why no loop could be built.
    """
    if isinstance(loop, str):
        path = folder / "report.html"
        write_text(path, fit_page(model, data, sentence(told)))
        return path
    sections = [*_verdict(loop, data, told), *fit_sections(model, data), _controller(loop, notes)]
    return write_report(loop.results, folder, sections, f"{name}: model, inverse, loop")


def reference_table(told: dict[str, Any]) -> tuple[list[str], list[list[str]]]:
    """Return the head and the rows of the table of expected errors."""
    head = [
        "reference",
        "rate, Hz",
        "on the device, RMS %",
        "at most %",
        "with the model as device, RMS %",
        "why not known",
    ]
    rows = [
        [
            r["name"],
            f"{r['frequency']:.4g}",
            percent(r["rms_percent"]),
            percent(r["bound_percent"]),
            percent(r["model_percent"]),
            r["reason"],
        ]
        for r in told["references"]
    ]
    return head, rows


def race_table(loop: ClosedLoop, page: bool = True) -> tuple[list[str], list[list[str]]]:
    """Return the head and the rows of the table of controller structures, beginning with the best one.

    If `page` is True, the table also contains the tuned parameters of each structure, and a row with the reason for
    each structure that cannot be used.
    """
    names = list(loop.contenders[0].errors) if loop.contenders else []
    head = ["structure", *(f"{n}, RMS %" for n in names), "bandwidth, Hz", "Ms, dB", "Ms over the set, dB"]
    head += ["gain margins, dB", "phase margin, deg", "delay margin, steps", "noise, %", "overshoot, %", "settling, s"]
    head += ["values"] * page
    size = 100 / (2 * loop.promises[0].amplitude)
    rows = []
    for c in loop.contenders:
        t, m = c.tuned, c.tuned.margins
        step = ["", ""] if c.step is None else [f"{max(c.step.overshoot, 0.0):.3g}", f"{c.step.settling:.3g}"]
        rows.append(
            [
                t.structure.name,
                *(percent(e) for e in c.errors.values()),
                f"{t.bandwidth:.3g}",
                f"{t.ms_db:.1f}",
                f"{t.set_ms_db:.1f}",
                f"{m.gain_low_db:.3g}; {m.gain_db:.3g}",
                f"{m.phase_deg:.3g}",
                f"{m.delay_steps:.3g}",
                percent(size * t.noise_gain * loop.device.noise),
                *step,
                *([", ".join(f"{k} {v:.4g}" for k, v in {"Ki": t.Ki, **t.values}.items())] * page),
            ]
        )
    empty = [""] * (len(head) - 2)
    rows += [[name, f"not usable: {why}", *empty] for name, why in loop.race.refused.items() if page]
    return head, rows


def _verdict(loop: ClosedLoop, data: Dataset, told: dict[str, Any]) -> tuple[Section, Section]:
    """Return two sections: the verdict with plots, and the table of expected errors.

    The plots compare the output for a static gain in place of the inverse with the output of the loop.
    """
    shown = {"before: a gain alone": "neither", "after: the loop": loop.promises[0].name}
    unit = f" ({data.unit_y})" if data.unit_y else ""
    reached = {}
    for title, case in shown.items():
        found = next(r for r in loop.results if r.case == case)
        if found.trace is None:
            continue
        signals = [found.trace["reference.r"], found.trace[found.system.case.metrics["tracking"].signal]]
        r, y = (v[len(v) // 2 :] for v in signals)
        reached[title] = found.trace.t[-len(r) :], r, y
    first = loop.promises[0]
    known = first.rms_percent is not None
    answer = f"{sentence(told)}. The RMS error of the {first.name} on the device is "
    answer += f"{percent(first.rms_percent)} % of peak to peak." if known else f"not known: {first.why}."
    tables = [Table(*reference_table(told)), Table(("reason",), [(line,) for line in told["reasons"]])]
    errors = Section("Errors of the loop", OF_REFERENCE, tables[: 1 + bool(told["reasons"])])
    return Section("", answer, (), compared(reached, unit, LOOP_POINTS)), errors


def _controller(loop: ClosedLoop, notes: list[str]) -> Section:
    margins = loop.margins
    limits = [[v.limit, "unstable" if v.value is None else v.value, v.bound, v.where, v.word] for v in margins.verdicts]
    text = "No feedback: feed-forward and inverse."
    if loop.tuned is not None:
        text = (
            f"{loop.tuned.structure.text} in front of the inverse. Each structure is tuned for the least expected "
            "error. Ms must not exceed the limit for the identified device, and 12 dB for every device that agrees "
            "with the record. The simplest structure within 5 % of the least error is selected."
        )
    steps = [[s.name, percent(s.overshoot), f"{s.settling:.3g}"] for s in loop.steps]
    tables = [Table(*race_table(loop))] if loop.race.found or loop.race.refused else []
    tables += [Table(("limit of the loop", "value", "bound", "at", "verdict"), limits)] if limits else []
    tables += [Table(("steps", "overshoot, %", "settling, s"), steps)] if steps else []
    tables += [Table(("note",), [(n,) for n in notes])] if notes else []
    return Section("Controller", text, tables)
