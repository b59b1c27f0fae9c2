"""Display of a scenario in a notebook: units, connections, metrics and cases as tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hystfmu.base.printable import escape
from hystfmu.report.page import Table, table

_KINDS = ("model", "block", "graph", "inverse_of", "fmu")  # what a unit is, one of them


def scenario_html(spec: Mapping[str, Any]) -> str:
    """Return a scenario as HTML.

    Parameters
    ----------
    spec : mapping
        The keys of a scenario.toml; it may be incomplete.
    """
    units: dict[str, Any] = spec.get("units", {})
    order = [*(n for n in spec.get("order", ()) if n in units), *(n for n in units if n not in spec.get("order", ()))]
    found = [
        Table(("unit", "kind", "what it is", "text"), [(n, *_kind(units[n]), units[n].get("text", "")) for n in order]),
        Table(("source", "input"), [(source, to) for to, source in spec.get("connections", {}).items()]),
        Table(
            ("metric", "kind", "signal", "against", "limit"),
            [
                (n, m["kind"], m["signal"], m.get("against", ""), m.get("limit", ""))
                for n, m in spec.get("metrics", {}).items()
            ],
        ),
        Table(("case", "text"), [(c["name"], c.get("text", "")) for c in spec.get("case", ())]),
    ]
    stop = f", {spec['stop']:g} s" if "stop" in spec else ""
    text = f": {spec['text']}" if spec.get("text") else ""
    head = f"<p><b>{escape(spec['name'])}</b>{escape(text)}; step {spec['step']:g} s{stop}</p>"
    return head + "".join(table(t) for t in found if t.rows)


def _kind(unit: Mapping[str, Any]) -> tuple[str, str]:
    kind = next(k for k in _KINDS if k in unit)
    return kind, "" if kind == "graph" else str(unit[kind])
