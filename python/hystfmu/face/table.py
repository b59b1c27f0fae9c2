"""Completes a scenario that is built in Python, with the keys of a scenario.toml, and writes it to a folder.

If a key is not given, it gets this default value:

- ``connections``: the default connections of inverse and controller, see below.
- ``reference``: if connections or metrics name this unit, but it was not added, the unit is created. It is a sine over
  SHARE of the stroke of the plant, with SAMPLES steps per period. The plant is the unit that a metric compares with the
  reference. The output `r_lead` is one step ahead, or half a step if the run has steps between samples.
- ``stop``: PERIODS periods of the slowest reference. A metric without its own `after` starts after the first period.
- ``order``: the order in which the units were added; the default reference is first.
- ``record``: the signals of the metrics.

Default connections:

- Inverse: ``inverse.u`` as a source means the output of the inverse, even if this output has another name. An inverse
  without a source reads ``reference.r_lead``, which is ahead of the reference by the delay of a step.
- Controller without connections: it is inserted in front of the plant. The former source of the plant becomes the
  feed-forward u_ff of the controller, and the output u of the controller drives the plant. The controller compares
  ``reference.r`` with the signal of the metric.
- Controller with a connected output: it keeps its connections, and the missing inputs y_d and y are connected. An
  unconnected feed-forward u_ff is 0.

The saved scenario.toml states all connections.
"""

import copy
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base import InputError, escape, read_bytes, write_bytes, write_toml
from hystfmu.core.library import block_types
from hystfmu.graph import Graph, Node
from hystfmu.graph.blocks import Block
from hystfmu.graph.tables import graph_tables
from hystfmu.model import Model
from hystfmu.report.page import Table, table
from hystfmu.scenario.system.spec import FORMAT, SOURCES, ScenarioSpec

What = Model | Block | Node | Graph | str | Path
FILES = ("model", "fmu", "inverse_of")  # keys of a unit that hold a path


def described(what: What, name: str, where: str) -> tuple[dict[str, Any], dict[str, Model | Path]]:
    """Return the table of a unit in scenario.toml, and the models or files to which the paths in this table refer.

    Parameters
    ----------
    what : Model, Block, Node, Graph, or path of an FMU or a model file
    name : str
        Name of the unit. The file of the unit has the same name.
    where : str
        Scenario and unit, as prefix of error messages.

    Raises
    ------
    InputError
        `what` has another type, or a model file cannot be read.
    """
    if isinstance(what, Block):
        what = what.node
    if isinstance(what, Node):
        table: dict[str, Any] = {"block": what.type}
        table |= {"dims": dict(what.dims)} if what.dims else {}
        return table | ({"values": {k: _plain(v) for k, v in what.values.items()}} if what.values else {}), {}
    if isinstance(what, Graph) and what.step:  # the tables of a graph do not hold its step, a model does
        what = Model("graph", what, what.step)
    if isinstance(what, Graph):
        return {"graph": graph_tables(what)}, {}
    if isinstance(what, (str, Path)):
        path = Path(what)
        if path.suffix == ".fmu":
            return {"fmu": f"{name}.fmu"}, {f"{name}.fmu": path.absolute()}
        if path.suffix != ".toml":
            raise InputError(f"{where}: The path must end in .fmu or .model.toml. Got {str(what)!r} instead.")
        what = Model.load(path)
    if isinstance(what, Model):
        return {"model": f"{name}.model.toml"}, {f"{name}.model.toml": what}
    raise InputError(f"{where}: A unit must be a model, a block, a graph or a path. Got {type(what).__name__} instead.")


def files(spec: Mapping[str, Any]) -> list[tuple[dict[str, Any], str]]:
    """Return all unit tables (scenario and cases) that contain a file name, each with the key of this file name."""
    units = [*spec.get("units", {}).values(), *(u for c in spec.get("case", ()) for u in c.get("units", {}).values())]
    return [(u, key) for u in units for key in FILES if key in u]


def _plain(value: Any) -> Any:
    """Convert a parameter value to a type of TOML."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.ravel().tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    return value


Wires = dict[str, str]  # input -> output, as in a scenario.toml
CONTROLLER = {"y_d", "y", "u_ff"}


def wired(spec: Mapping[str, Any], attached: Mapping[str, Model | Path]) -> Wires:
    """Return all connections of a scenario: the given connections, completed by the default connections.

    Parameters
    ----------
    spec : mapping
        The given keys of the scenario.
    attached : mapping of str to Model or Path
        Models of units, by their paths in the scenario.
    """
    wires: Wires = dict(spec.get("connections", {}))
    units: Mapping[str, Any] = spec.get("units", {})
    inverses = {name: m for name, u in units.items() if (m := _inverse(u, attached)) is not None}
    for target, source in wires.items():
        name, _, port = source.partition(".")
        if name in inverses and port == "u" and port not in {o.name for o in inverses[name].graph.outputs}:
            wires[target] = f"{name}.{inverses[name].graph.outputs[0].name}"
    measured = _measured(spec)
    if measured is None:
        return wires
    for name in inverses:
        end = f"{name}.{inverses[name].graph.inputs[0].name}"
        used = any(source.startswith(f"{name}.") for source in wires.values())
        if used and end not in wires:
            wires[end] = "reference.r_lead"
    plant = f"{measured.split('.')[0]}.u"
    alone = [name for name, u in units.items() if _loop_ports(u) == CONTROLLER and not _touched(name, wires)]
    if len(alone) == 1 and plant in wires:  # two without a wire: neither place is said
        (name,) = alone
        wires |= {f"{name}.u_ff": wires[plant], f"{name}.y_d": "reference.r", f"{name}.y": measured}
        wires[plant] = f"{name}.u"
    for name, unit in units.items():
        drives = any(source.startswith(f"{name}.") for source in wires.values())
        if drives and (ports := _loop_ports(unit)):
            fixed = unit.get("inputs", {})
            for port, source in (("y_d", "reference.r"), ("y", measured)):
                if port in ports and port not in fixed:
                    wires.setdefault(f"{name}.{port}", source)
    return wires


def at_rest(units: Mapping[str, Any], wires: Mapping[str, str]) -> dict[str, Any]:
    """Return the tables of the units, with the feed-forward 0 for a connected controller without feed-forward signal.

    Parameters
    ----------
    units : mapping
        Tables of the units.
    wires : mapping
        All connections.
    """
    made = dict(units)
    for name, unit in units.items():
        drives = any(source == f"{name}.u" for source in wires.values())
        if _loop_ports(unit) == CONTROLLER and drives and f"{name}.u_ff" not in wires:
            made[name] = {**unit, "inputs": {"u_ff": 0.0} | unit.get("inputs", {})}
    return made


def _inverse(unit: Mapping[str, Any], attached: Mapping[str, Model | Path]) -> Model | None:
    """Return the model of a unit if it is an inverse with one input and one output, else None."""
    model = attached.get(unit.get("model", ""))
    if not isinstance(model, Model) or "inverse" not in model.provenance:
        return None
    return model if len(model.graph.inputs) == len(model.graph.outputs) == 1 else None


def _measured(spec: Mapping[str, Any]) -> str | None:
    """Return the signal of the first metric that compares a signal with a reference; None without such a metric."""
    for m in spec.get("metrics", {}).values():
        if (m.get("against") or "").startswith("reference."):
            return str(m["signal"])
    return None


def _loop_ports(unit: Mapping[str, Any]) -> set[str]:
    """Return the names of all inputs of a controller that has y_d and y; an empty set for any other unit."""
    block = block_types().get(unit.get("block", ""))
    ports = {v.name for v in block.of("input")} if block is not None and block.family == "controllers" else set()
    return ports if {"y_d", "y"} <= ports else set()


def _touched(name: str, wires: Wires) -> bool:
    return any(end.startswith(f"{name}.") for pair in wires.items() for end in pair)


NAME = "reference"
SHARE, SAMPLES, PERIODS = 0.8, 1000, 3
ROWS = 1000  # of the ramp that finds the stroke of a plant


def completed(spec: Mapping[str, Any], attached: Mapping[str, Model | Path], origin: str) -> dict[str, Any]:
    """Return the complete content of a scenario.toml.

    Parameters
    ----------
    spec : mapping
        The given keys of the scenario.
    attached : mapping of str to Model or Path
        Models of units, by their paths in the scenario.
    origin : str
        Prefix of error messages.

    Raises
    ------
    InputError
        There is no unit or metric, no reference can be made, or the end of the run is not defined.
    """
    units: dict[str, Any] = dict(spec.get("units", {}))
    metrics: dict[str, Any] = {k: dict(m) for k, m in spec.get("metrics", {}).items()}
    if not units:
        raise InputError(f"{origin}: A scenario must have a unit. Got none; add(name, model) adds one.")
    if not metrics:
        raise InputError(f"{origin}: A scenario must have a metric. Got none; metric(name, kind, signal) adds one.")
    order = list(spec.get("order", units))
    if wires := wired(spec, attached):
        spec = {**spec, "connections": wires}
        units = at_rest(units, wires)
    if NAME not in units and _asks_for_reference(spec):
        units = {NAME: _reference(spec, attached, origin), **units}
        order = [NAME, *order]
    whole = {**spec, "order": order, "units": units, "metrics": metrics}
    if "stop" not in spec:
        period = _period(units, origin)
        whole["stop"] = _steps(PERIODS * period, spec["step"])
        for m in metrics.values():
            m.setdefault("after", _steps(period, spec["step"]))
    if "record" not in spec:
        named = [m[key] for m in metrics.values() for key in ("against", "signal") if m.get(key)]
        whole["record"] = list(dict.fromkeys(named))
    return whole


def _asks_for_reference(spec: Mapping[str, Any]) -> bool:
    named = [*spec.get("connections", {}).values()]
    named += [m.get(key) or "" for m in spec.get("metrics", {}).values() for key in ("signal", "against")]
    return any(end.startswith(f"{NAME}.") for end in named)


def _reference(spec: Mapping[str, Any], attached: Mapping[str, Model | Path], origin: str) -> dict[str, Any]:
    """Return the table of the default unit `reference`, a sine over a share of the stroke of the plant."""
    plant = (_measured(spec) or "plant").split(".")[0]
    unit = spec["units"].get(plant, {})
    model = attached.get(unit.get("model", ""))
    span = model.provenance.get("span_u") if isinstance(model, Model) else None
    if not isinstance(model, Model) or span is None:
        raise InputError(
            f"{origin}: units: The stroke of {plant!r} must be known to make a unit {NAME!r}. Got no identified model; "
            f"add({NAME!r}, hystfmu.blocks.Reference(amplitude=..., frequency=...))."
        )
    lo, hi = span
    start = float(model.graph.inputs[0].start)
    path = [np.linspace(a, b, ROWS) for a, b in ((start, lo), (lo, hi), (hi, lo))]
    y = model.predict(np.concatenate(path))[ROWS:]
    low, high = float(y.min()), float(y.max())
    fine = any(u.get("fine") for u in spec["units"].values())
    between = fine and spec.get("ripple", 1) > 1
    values = {
        "shape": "sine",
        "amplitude": SHARE * (high - low) / 2,
        "offset": (high + low) / 2,
        "frequency": float(f"{1 / (SAMPLES * spec['step']):.6g}"),
        "lead": spec["step"] / 2 if between else spec["step"],
    }
    text = f"{100 * SHARE:g} % of the stroke of {plant}"
    return {"block": "reference", "values": values, "text": text, **({"fine": True} if fine else {})}


def _period(units: Mapping[str, Any], origin: str) -> float:
    """Return the period of the slowest reference (s)."""
    rates = []
    for u in units.values():
        if u.get("block") == "reference":
            values = {**u.get("values", {}), **u.get("set", {})}
            f = values.get("frequency", 1.0)
            if values.get("shape", "sine") in ("sine", "triangle", "decaying_sine") and f > 0:
                rates.append(f)
    if not rates:
        raise InputError(
            f"{origin}: stop: The end of the run must be given, or follow from a periodic reference. Got neither; "
            "Scenario(..., stop=...) states it."
        )
    return float(1 / min(rates))


def _steps(seconds: float, step: float) -> float:
    """Round a time up to a whole number of steps."""
    return float(f"{math.ceil(seconds / step * (1 - 1e-9)) * step:.12g}")


def save(spec: Mapping[str, Any], attached: Mapping[str, Model | Path], folder: Path) -> Path:
    """Write scenario.toml, and the models and FMUs of all units, into one folder.

    Parameters
    ----------
    spec : mapping
        Complete content of the file.
    attached : mapping of str to Model or Path
        Models or files of the units, by their paths in the scenario.
    folder : Path

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        A file cannot be read or written.
    """
    content = copy.deepcopy(dict(spec))
    names: dict[str, str] = {}
    for unit, key in files(content):
        path = unit[key]
        if path not in names:
            names[path] = _unique(Path(path).name, set(names.values()))
        unit[key] = names[path]
    for path, name in names.items():
        what = attached[path]
        if isinstance(what, Model):
            what.save(folder / name)
        else:
            write_bytes(folder / name, read_bytes(what))
    ordered = {"format": FORMAT, **{k: content[k] for k in ScenarioSpec.model_fields if k in content}}
    write_toml(folder / "scenario.toml", ordered)
    return folder


def _unique(name: str, taken: set[str]) -> str:
    """Return a file name that is not in `taken`; if necessary, insert a number before the suffixes."""
    stem, dot, suffix = name.partition(".")
    k, free = 1, name
    while free in taken:
        k += 1
        free = f"{stem}_{k}{dot}{suffix}"
    return free


def scenario_html(spec: Mapping[str, Any]) -> str:
    """Return the tables of a scenario as HTML for a notebook.

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
    kind = next(k for k in SOURCES if k in unit)
    return kind, "" if kind == "graph" else str(unit[kind])
