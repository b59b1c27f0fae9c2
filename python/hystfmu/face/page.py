"""Tables of a model for terminal and notebook, and the HTML page about a fit."""

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from hystfmu.base import Array, InputError, escape, with_unit
from hystfmu.core.library import NO_LIMIT
from hystfmu.data import Dataset
from hystfmu.face.interval import free_run, interval_text, known, parts, table_of
from hystfmu.inverse import invert
from hystfmu.model import Model
from hystfmu.model.coverage import span_of
from hystfmu.model.explored import explored
from hystfmu.report.explorer import Explorer
from hystfmu.report.page import Section, Table, hero, page, percent, section
from hystfmu.report.plot import LOOP_POINTS, Line, Plot

MOST_SHOWN, MOST_FREE = 12, 24  # parameters, and free parameters, in print(model)


def tables(model: Model) -> list[Table]:
    """Return the tables of ports, parameters, free parameters and errors of a model."""
    g = model.graph
    ports = [
        (p.kind, p.name if p.size == 1 else f"{p.name}[{p.size}]", "" if p.unit == "1" else p.unit, p.text)
        for p in g.ports
        if p.kind in ("input", "output")
    ]
    parameters = [p for p in g.ports if p.is_parameter]
    shown: list[tuple[object, ...]] = [
        (p.name, p.size, "" if p.unit == "1" else p.unit, _start(p.start)) for p in parameters[:MOST_SHOWN]
    ]
    if len(parameters) > MOST_SHOWN:
        shown.append(("...", f"{len(parameters) - MOST_SHOWN} more", "", ""))
    found = [Table(("port", "name", "unit of measure", "meaning"), ports)]
    if shown:
        found.append(Table(("parameter", "size", "unit of measure", "value"), shown))
    if free := free_table(model):
        found.append(free)
    errors = _error_rows(model)
    return [*found, Table(("errors", "RMS %", "largest %"), errors)] if errors else found


def free_table(model: Model) -> Table | None:
    """Return a table of the fitted parameters of a graph with standard errors, or None if there are none."""
    rows = [
        (name, f"{of['value']:.6g}", f"{of['standard_error']:.2g}" if "standard_error" in of else of["known"])
        for name, of in model.fit.get("free", {}).items()
    ]
    if len(rows) > MOST_FREE:
        rows = [*rows[:MOST_FREE], ("...", f"{len(rows) - MOST_FREE} more", "")]
    return Table(("free parameter", "value", "standard error"), rows) if rows else None


def _error_rows(model: Model) -> list[tuple[str, str, str]]:
    """Return table rows with the errors on training rows, held-out rows and validation blocks.

    For an inverse, the result also contains a row with the errors of inverse and model in series.
    """
    f, rows = model.fit, []
    named = [("", f"training rows {model.provenance.get('train', '')}".strip()), ("held_out_", "held-out rows")]
    for prefix, name in [*named, ("cascade_", "inverse and model in cascade")]:
        if f"{prefix}rms_percent" in f:
            rows.append((name, percent(f[f"{prefix}rms_percent"]), percent(f[f"{prefix}max_percent"])))
    split = model.provenance.get("auto", {}).get(model.provenance.get("auto_choice"))
    if split is not None:
        rows.append(("validation blocks that chose the model", percent(split), ""))
    return rows


def evidence_lines(model: Model) -> list[str]:
    """Return lines of text about the linear dynamics in the record; [] if the fit stored no such evidence."""
    if "evidence" not in model.fit:
        return []
    from hystfmu.identify.evidence import Evidence

    return Evidence.from_dict(model.fit["evidence"]).lines(model.graph.outputs[0].unit)


def names(model: Model, kind: str) -> str:
    """Return the names of all ports of a kind, such as "input", as text: `u`, or `z[5]` for an array."""
    return ", ".join(p.name if p.size == 1 else f"{p.name}[{p.size}]" for p in model.graph.ports if p.kind == kind)


def _start(values: tuple[float, ...]) -> str:
    text = " ".join("no limit" if abs(v) >= NO_LIMIT else f"{v:.4g}" for v in values[:4])
    return f"{text} ..." if len(values) > 4 else text


def explorer(models: Sequence[Model], data: Dataset | None, u_label: str, y_label: str) -> Explorer:
    """Return a page section in which the reader changes the input of models and sees their outputs (explorer).

    Parameters
    ----------
    models : sequence of Model
        Models that were fitted to `data`.
    data : Dataset, optional
        Data whose measured points are shown.
    u_label, y_label : str
        Names of input and output with their units of measure.
    """
    shown = [explored(m, m.key, _analytic(m)) for m in models]
    return Explorer(shown, u_label, y_label, None if data is None else (data.u, data.y))


def explorer_of(model: Model) -> Explorer | None:
    """Return the explorer of one model without measured points, or None.

    The result is None if the first input or the first output is not a scalar, or if the model does not state the range
    of its input.
    """
    first = {kind: [p for p in model.graph.ports if p.kind == kind] for kind in ("input", "output")}
    if span_of(model) is None or [p.size for (p, *_) in filter(None, first.values())] != [1, 1]:
        return None
    labels = [with_unit(p.name, p.unit) for (p, *_) in first.values()]
    return explorer([model], None, *labels)


def _analytic(model: Model) -> Model | None:
    """Return the exact or the implicit inverse of a model; None if neither of them exists."""
    for method in ("exact", "implicit"):
        with suppress(InputError):
            return invert(model, method)
    return None


FREQUENCY = "frequency (Hz)"
LEAST_GAIN = 1e-4
TEXT = (
    "Frequency response from the output of the hysteresis to the measured output, divided by its static gain, and "
    "coherence, with the coherence that chance exceeds in 1 %. The record gives no information about the device in the "
    "shaded band. +- is one standard error."
)


def evidence_section(model: Model) -> list[Section]:
    """Return the section about linear dynamics in a list. The list is empty if the fit stored no such evidence."""
    if "evidence" not in model.fit:
        return []
    from hystfmu.identify.evidence import Evidence

    e = Evidence.from_dict(model.fit["evidence"])
    if not len(e.f):
        return []
    x, gain = e.f, 20 * np.log10(np.maximum(e.gain, LEAST_GAIN))
    lines = [Line("measured", x, gain)]
    if e.modes:
        at = np.array([m.f_n for m in e.modes])
        lines.append(Line("modes", at, np.interp(at, x, gain), dots=True))
    dark = _dark(x, e.band, float(gain.min()), float(gain.max()))
    rows = [
        (k, *(f"{v:.3g}" for v in (m.f_n, m.f_n_se, m.zeta, m.zeta_se, 100 * m.share, 100 * m.share_se)))
        for k, m in enumerate(e.modes, 1)
    ]
    table = Table(("mode", "f_n (Hz)", "+-", "damping ratio", "+-", "share of the static gain (%)", "+-"), rows)
    plots = [
        Plot("frequency response", FREQUENCY, "gain (dB)", [*lines, *dark], log_x=True),
        Plot(
            "coherence",
            FREQUENCY,
            "coherence",
            [Line("coherence", x, e.coherence), Line("chance", x, e.significant), *_dark(x, e.band, 0.0, 1.0)],
            log_x=True,
        ),
    ]
    text = " ".join(f"{line[:1].upper()}{line[1:]}." for line in evidence_lines(model))
    return [Section("Evidence", f"{text} {TEXT}", [table] if rows else [], plots)]


def _dark(x: Array, band: tuple[float, float], low: float, high: float) -> list[Line]:
    """Return a shaded area for the frequencies above the coherent `band`, from `low` to `high` on the vertical axis."""
    first = float(band[1]) if band[1] > 0 else float(x[0])
    if first >= x[-1]:
        return []
    return [Line("not excited", np.array([first, first, x[-1], x[-1]]), np.array([low, high, high, low]), shade=True)]


EXPLORED = "The model of the FMU runs in this page. Its inverse is here if it is exact or implicit."
SEGMENT = 1024  # rows of a segment of the spectrum
FLOOR = 1e-12  # least amplitude that is drawn, relative to the span


def fit_page(model: Model, data: Dataset, lead: str = "") -> str:
    """Return the page about a fit as HTML.

    Parameters
    ----------
    model : Model
        Model that was fitted to the training rows of `data`.
    data : Dataset
        Data with a measured output.
    lead : str
        First sentence of the page. The default is the description of the model.
    """
    title = f"{model.key} fitted to {data.name}"
    head = [f"<h1>{escape(title)}</h1>", f'<p class="lead">{escape(lead or model.text)}</p>']
    return page(title, [*head, hero(_loop(free_run(model, data), data)), *map(section, fit_sections(model, data))])


def fit_sections(model: Model, data: Dataset) -> list[Section]:
    """Return the sections of `fit_page`: errors, evidence, explorer, warnings, model, origin."""
    y = free_run(model, data)
    first = Section(
        "Errors",
        interval_text(known(model, data), data.unit_y),
        [table_of(parts(y, data, True), data.unit_y)],
        _error_plots(y, data),
    )
    labels = with_unit("u", data.unit_u), with_unit("y", data.unit_y)
    warned = model.fit.get("warnings", [])
    warnings = Section(
        "Warnings of the fit",
        "" if warned else "None.",
        [Table(("warning",), [(w,) for w in warned])] if warned else [],
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
    return Plot("loops", with_unit("u", data.unit_u), with_unit("y", data.unit_y), lines, points=LOOP_POINTS)


def _error_plots(y: Array, data: Dataset) -> list[Plot]:
    """Return plots of the error over time, the error over the input, and the spectrum of the error."""
    e, label = data.y - y, with_unit("measured - model", data.unit_y)
    t: Array = np.arange(len(e), dtype=np.float64) * data.h  # records follow one another
    rows = {"training rows": np.zeros(len(e), dtype=bool)}
    rows["training rows"][data.train] = True
    if not rows["training rows"].all():
        rows["held-out rows"] = ~rows["training rows"]
    over_time = [Line(name, t[k], e[k]) for name, k in rows.items()]
    over_input = [Line(name, data.u[k], e[k]) for name, k in rows.items()]
    return [
        Plot("error over time", "time (s)", label, over_time, envelope=True),
        Plot("error over the input", with_unit("u", data.unit_u), label, over_input, points=LOOP_POINTS),
        _spectrum(e, data),
    ]


def _spectrum(e: Array, data: Dataset) -> Plot:
    """Return a plot of the amplitude spectral densities of the error and of the output."""

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
    """Return frequencies (Hz) and the power spectral density of a signal with the step h (s), each of shape (m,).

    The signal is divided into segments that overlap by half. From each segment, the mean is subtracted, and a Hann
    window is applied. The density is the mean over all segments (Welch, IEEE Trans. Audio and Electroacoustics 15
    (1967) 70-73).
    """
    from scipy.signal import welch

    f, power = welch(v, 1 / h, nperseg=min(SEGMENT, len(v)))
    return np.asarray(f), np.asarray(power)


def _origin(model: Model) -> Table:
    known = model.provenance
    rows: list[tuple[str, object]] = [(k, known[k]) for k in ("data", "rows", "train", "seed", "sha256") if k in known]
    options = known.get("options", {})
    rows += [(f"option {k}", options[k]) for k in options]
    rows += [(f"version of {k}", v) for k, v in known.get("versions", {}).items()]
    return Table(("origin", "value"), rows)
