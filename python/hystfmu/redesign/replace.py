"""Replace the controllers of a scenario by one unit with inputs y_d, y, u_ff and output u.

The controllers are found from the connections. They are all units on paths from the measured output to the command.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hystfmu.base.errors import InputError
from hystfmu.face.scenario import Scenario
from hystfmu.face.table import What
from hystfmu.redesign.roles import Roles
from hystfmu.scenario.system.system import System, behind

LIMITS = ("u_min", "u_max")  # of a command, which another controller keeps


@dataclass(frozen=True)
class Controllers:
    """The replaced units in their order, and the feed-forward that these units add to their command."""

    units: tuple[str, ...]
    feedforward: str | None


def controllers(system: System, of: Roles) -> Controllers:
    """Find the units between the measured output and the command.

    An InputError is raised if there is no such unit, or if these units read several signals other than reference and
    measured output.
    """
    owner = {p.name: k for k, p in enumerate(system.parts)}
    ends = [(system.names[n.source], system.parts[n.to].name, system.parts[n.to].inputs[n.input]) for n in system.links]
    forward = [(owner[source.partition(".")[0]], owner[unit]) for source, unit, _ in ends]
    target, driver = (owner[end.partition(".")[0]] for end in (of.command, of.driver))
    readers = {owner[unit] for source, unit, _ in ends if source == of.measured} - {target}
    before = behind([(b, a) for a, b in forward if target not in (a, b)], driver) | {driver}
    after = set(readers)
    for k in readers:
        after |= behind([e for e in forward if target not in e], k)
    found = after & before
    names = tuple(p.name for k, p in enumerate(system.parts) if k in found)
    where = system.case.title
    if not names:
        raise InputError(f"{where}: A controller must act between {of.measured} and {of.command}. Got none.")
    into = {(source, port) for source, unit, port in ends if unit in names and source.partition(".")[0] not in names}
    ahead = {source for source, _ in into} - {of.measured, of.reference}
    ahead = ahead or {source for source, port in into if source == of.reference and port == "u_ff"}
    if len(ahead) > 1:
        raise InputError(
            f"{where}: The controllers must take one feed-forward beside reference and measured output. Got "
            f"{', '.join(sorted(ahead))}."
        )
    return Controllers(names, next(iter(ahead), None))


def replaced(
    loop: Scenario, of: Roles, old: Controllers, name: str, unit: What, text: str, kept: Sequence[str]
) -> Scenario:
    """Return the scenario with one `unit` instead of its controllers. The unit has inputs y_d, y, u_ff and output u.

    The new scenario contains the cases in `kept` that do not depend on the old controllers (see `depends`).
    """
    table = loop.table
    gone = set(old.units)
    last = of.driver.partition(".")[0]
    for t in (table, *table.get("case", ())):
        if "order" in t:
            t["order"] = [name if u == last else u for u in t["order"] if u == last or u not in gone]
        if "set" in t:
            t["set"] = {_parameter(k, gone, name): v for k, v in t["set"].items()}
    order = table["order"]
    table["units"] = {k: u for k, u in table["units"].items() if k not in gone}
    wires = {to: source for to, source in table["connections"].items() if to.partition(".")[0] not in gone}
    table["connections"] = {to: _signal(s, of, gone, name) or s for to, s in wires.items()}
    metrics = {k: _metric(m, of, gone, name) for k, m in table["metrics"].items()}
    table["metrics"] = {k: m for k, m in metrics.items() if m is not None}
    table["record"] = [s for end in table.get("record", ()) if (s := _signal(end, of, gone, name)) is not None]
    pairs = [[_signal(end, of, gone, name) for end in pair] for pair in table.get("loops", ())]
    table["loops"] = [pair for pair in pairs if None not in pair]
    if "case" in table:
        table["case"] = [_case(c, table["metrics"]) for c in table["case"] if c["name"] in kept]
    table["order"] = [u for u in order if u != name]
    made = loop.changed(table)
    ahead = old.feedforward
    made.add(name, unit, text=text, inputs={} if ahead is not None else {"u_ff": 0.0})
    for source, port in ((of.reference, "y_d"), (of.measured, "y"), *([(ahead, "u_ff")] if ahead is not None else [])):
        made.connect(source, f"{name}.{port}")
    return made.order(*order)


def depends(case: Mapping[str, Any], old: Controllers) -> bool:
    """Return whether a case changes a controller in more than the limits of its command.

    Such a case cannot run without this controller.
    """
    gone = set(old.units)
    sets = {k.rpartition(".")[2] for k in case.get("set", {}) if k.partition(".")[0] in gone}
    ends = {end.partition(".")[0] for pair in case.get("connections", {}).items() for end in pair}
    return bool(sets - set(LIMITS) or ends & gone or set(case.get("units", {})) & gone)


def _parameter(key: str, gone: set[str], name: str) -> str:
    unit, _, parameter = key.partition(".")
    return f"{name}.pid_{parameter}" if unit in gone and parameter in LIMITS else key


def _signal(end: str, of: Roles, gone: set[str], name: str) -> str | None:
    """Return the signal that replaces an output: the new command, or None for a removed inner signal."""
    if end == of.driver:
        return f"{name}.u"
    return None if end.partition(".")[0] in gone else end


def _metric(metric: dict[str, Any], of: Roles, gone: set[str], name: str) -> dict[str, Any] | None:
    made = dict(metric)
    for key in ("signal", "against"):
        if metric.get(key) is not None:
            made[key] = _signal(metric[key], of, gone, name)
    return None if None in (made["signal"], made.get("against", "")) else made


def _case(case: dict[str, Any], metrics: Mapping[str, Any]) -> dict[str, Any]:
    """Return a case without limits of removed metrics."""
    return {**case, "limits": {k: v for k, v in case.get("limits", {}).items() if k in metrics}}
