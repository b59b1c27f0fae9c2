"""Tables of a model for a terminal and for a notebook: ports, parameters, errors."""

from __future__ import annotations

from hystfmu.core.library import NO_LIMIT
from hystfmu.model import Model
from hystfmu.report.page import Table, percent

MOST_SHOWN, MOST_FREE = 12, 24  # parameters, and free parameters, in print(model)


def tables(model: Model) -> list[Table]:
    """Return the tables of ports, parameters and errors."""
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
    errors = _errors(model)
    return [*found, Table(("errors", "RMS %", "largest %"), errors)] if errors else found


def free_table(model: Model) -> Table | None:
    """Return a table of the free parameters of a graph with their standard errors."""
    rows = [
        (name, f"{of['value']:.6g}", f"{of['standard_error']:.2g}" if "standard_error" in of else of["known"])
        for name, of in model.fit.get("free", {}).items()
    ]
    if len(rows) > MOST_FREE:
        rows = [*rows[:MOST_FREE], ("...", f"{len(rows) - MOST_FREE} more", "")]
    return Table(("free parameter", "value", "standard error"), rows) if rows else None


def _errors(model: Model) -> list[tuple[str, str, str]]:
    """Return the errors on training rows, held-out rows, validation blocks, and of the cascade."""
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
    """Return lines on the linear dynamics in the record; empty for inverses and for models of older versions."""
    if "evidence" not in model.fit:
        return []
    from hystfmu.identify.evidence import Evidence

    return Evidence.from_dict(model.fit["evidence"]).lines(model.graph.outputs[0].unit)


def names(model: Model, kind: str) -> str:
    """Return the names of the ports of a kind as text, such as `u` or `z[5]`."""
    return ", ".join(p.name if p.size == 1 else f"{p.name}[{p.size}]" for p in model.graph.ports if p.kind == kind)


def _start(values: tuple[float, ...]) -> str:
    text = " ".join("no limit" if abs(v) >= NO_LIMIT else f"{v:.4g}" for v in values[:4])
    return f"{text} ..." if len(values) > 4 else text
