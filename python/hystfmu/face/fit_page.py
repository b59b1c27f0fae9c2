"""Page of a fit: errors, interval, loops, residuals, parameters, warnings and provenance."""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.printable import escape
from hystfmu.data import Dataset
from hystfmu.face.evidence_section import evidence_section
from hystfmu.face.explore import explorer
from hystfmu.face.interval import interval_text, known
from hystfmu.face.rows import free_run, parts, table_of
from hystfmu.face.summary import tables
from hystfmu.model import Model
from hystfmu.report.page import Section, Table, hero, page, section
from hystfmu.report.plot import LOOP_POINTS, Line, Plot

EXPLORED = "The model of the FMU runs in this page. Its inverse is here if it is exact or implicit."
SEGMENT = 1024  # rows of a segment of the spectrum
FLOOR = 1e-12  # least amplitude that is drawn, relative to the span


def fit_page(model: Model, data: Dataset, lead: str = "") -> str:
    """Return the page as HTML.

    Parameters
    ----------
    model : Model
        Model that was fitted to the training rows of `data`.
    data : Dataset
        Data with a measured output.
    lead : str
        First sentence of the page; by default a description of the model.
    """
    title = f"{model.key} fitted to {data.name}"
    head = [f"<h1>{escape(title)}</h1>", f'<p class="lead">{escape(lead or model.text)}</p>']
    return page(title, [*head, hero(_loop(free_run(model, data), data)), *map(section, fit_sections(model, data))])


def fit_sections(model: Model, data: Dataset) -> list[Section]:
    """Return the sections of `fit_page`: errors with interval and plots, warnings, model, origin."""
    y = free_run(model, data)
    first = Section(
        "Errors",
        interval_text(known(model, data), data.unit_y),
        [table_of(parts(y, data, True), data.unit_y)],
        _errors(y, data),
    )
    labels = _with("u", data.unit_u), _with("y", data.unit_y)
    warned = model.fit.get("warnings", [])
    warnings = Section(
        "Warnings", "" if warned else "None.", [Table(("warning",), [(w,) for w in warned])] if warned else []
    )
    return [
        first,
        *evidence_section(model),
        Section("Explorer", EXPLORED, explorer=explorer([model], data, *labels)),
        warnings,
        Section("Model", "", tables(model)),
        Section("Origin", data.read_as, [_origin(model)]),
    ]


def _loop(y: Array, data: Dataset) -> Plot:
    lines = [Line("measured", data.u, data.y), Line("model", data.u, y)]
    return Plot("loops", _with("u", data.unit_u), _with("y", data.unit_y), lines, points=LOOP_POINTS)


def _errors(y: Array, data: Dataset) -> list[Plot]:
    """Draw the error over time and over the input, and its spectrum."""
    e, label = data.y - y, _with("measured - model", data.unit_y)
    t: Array = np.arange(len(e), dtype=np.float64) * data.h  # records follow one another
    rows = {"training rows": np.zeros(len(e), dtype=bool)}
    rows["training rows"][data.train] = True
    if not rows["training rows"].all():
        rows["held-out rows"] = ~rows["training rows"]
    over_time = [Line(name, t[k], e[k]) for name, k in rows.items()]
    over_input = [Line(name, data.u[k], e[k]) for name, k in rows.items()]
    return [
        Plot("error over time", "time (s)", label, over_time, envelope=True),
        Plot("error over the input", _with("u", data.unit_u), label, over_input, points=LOOP_POINTS),
        _spectrum(e, data),
    ]


def _spectrum(e: Array, data: Dataset) -> Plot:
    """Draw the amplitude densities of the error and of the output."""

    def line(name: str, v: Array) -> Line:
        f, power = densities(v - v.mean(), data.h)
        amplitude = np.sqrt(power[1:]) / data.span
        return Line(name, f[1:], 20 * np.log10(np.maximum(amplitude, FLOOR)))

    return Plot(
        "spectrum of the error",
        "frequency (Hz)",
        "dB of the span per sqrt(Hz)",
        [line("error", e), line("output", data.y)],
        log_x=True,
    )


def densities(v: Array, h: float) -> tuple[Array, Array]:
    """Return frequencies (Hz), shape (m,), and the power density of a signal with the step h (s), shape (m,).

    The density is the mean over segments that overlap by half. The mean of each segment is subtracted, and a Hann
    window is applied (Welch, IEEE Trans. Audio and Electroacoustics 15 (1967) 70-73).
    """
    n = min(SEGMENT, len(v))
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(n) / n)
    parts = np.lib.stride_tricks.sliding_window_view(v, n)[:: n - n // 2]
    seen = np.fft.rfft((parts - parts.mean(axis=1, keepdims=True)) * window)
    power: Array = np.mean(np.abs(seen) ** 2, axis=0) * h / np.sum(window**2)
    power[1 : (n + 1) // 2] *= 2  # both signs of a frequency
    return np.asarray(np.fft.rfftfreq(n, h), dtype=np.float64), power


def _origin(model: Model) -> Table:
    known = model.provenance
    rows: list[tuple[str, object]] = [(k, known[k]) for k in ("data", "rows", "train", "seed", "sha256") if k in known]
    options = known.get("options", {})
    rows += [(f"option {k}", options[k]) for k in options]
    rows += [(f"version of {k}", v) for k, v in known.get("versions", {}).items()]
    return Table(("origin", "value"), rows)


def _with(name: str, unit: str) -> str:
    return f"{name} ({unit})" if unit not in ("", "1") else name
