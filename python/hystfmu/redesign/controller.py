"""Replace the controllers of a scenario by a controller of a named structure, tuned for all loops of the scenario.

One unit with inputs y_d, y, u_ff and output u replaces the controllers. The controllers are all units on a path of
connections from the measured output to the command.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hystfmu.base import InputError
from hystfmu.design.loop import Margins
from hystfmu.design.race import MS_DB, SET_MS_DB, Limits, Tuned, tune
from hystfmu.design.structures import STRUCTURES
from hystfmu.face.scenario import Scenario
from hystfmu.face.table import What
from hystfmu.graph import Graph, Node
from hystfmu.redesign.corners import Corner, Roles, aim, corners, first_loop, known, loop_plants, roles, sector
from hystfmu.scenario import Results, build, run
from hystfmu.scenario.loop.opened import OpenedLoop
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.scenario.system.system import System, behind

LIMITS = ("u_min", "u_max")  # names of the limits of a command, which the new controller also has


@dataclass(frozen=True)
class Controllers:
    """Names of the controllers that are replaced, in their order, and of the feed-forward signal that they add."""

    units: tuple[str, ...]
    feedforward: str | None


def controllers(system: System, of: Roles) -> Controllers:
    """Find the controllers of a loop: the units between the measured output and the command, named in `of`.

    An InputError is raised if there is no such unit, or if these units have several inputs in addition to the reference
    and the measured output.
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
    """Return the scenario `loop` with one `unit` in place of the controllers `old`.

    The unit has inputs y_d, y, u_ff and output u. It gets the name `name` and the description `text`. `of` contains the
    names of the signals of the loop. The new scenario contains only the cases in `kept`.
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
    """Return whether a case changes the controllers `old` in more than the limits of the command.

    Such a case sets a parameter, a connection or a unit of these controllers, so it cannot be simulated without them.
    """
    gone = set(old.units)
    sets = {k.rpartition(".")[2] for k in case.get("set", {}) if k.partition(".")[0] in gone}
    ends = {end.partition(".")[0] for pair in case.get("connections", {}).items() for end in pair}
    return bool(sets - set(LIMITS) or ends & gone or set(case.get("units", {})) & gone)


def _parameter(key: str, gone: set[str], name: str) -> str:
    unit, _, parameter = key.partition(".")
    return f"{name}.pid_{parameter}" if unit in gone and parameter in LIMITS else key


def _signal(end: str, of: Roles, gone: set[str], name: str) -> str | None:
    """Return the signal that replaces `end`: the new command for the old one, None for other outputs of controllers.

    All other signals stay unchanged.
    """
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
    """Return a case without the limits of metrics that were removed."""
    return {**case, "limits": {k: v for k, v in case.get("limits", {}).items() if k in metrics}}


OFF = 0.05


@dataclass(frozen=True)
class Controller:
    """A loop with a new controller, and the results of the loop.

    Attributes
    ----------
    scenario : Scenario
        Scenario with the controller as one unit of blocks.
    tuned : Tuned
        Structure and gains of the controller, peaks of the sensitivity, and bandwidth of the loop.
    margins : Margins
        Stability margins of the loop in the first case.
    loops : int
        Number of loops for which the controller was tuned.
    before : dict of str to float
        Value of the first metric of each case with the old controllers.
    results : Results
        Results of the cases with the new controller.
    """

    scenario: Scenario
    tuned: Tuned
    margins: Margins
    loops: int
    before: dict[str, float]
    results: Results

    @property
    def gains(self) -> dict[str, float]:
        """Gains and other tuned values of the controller, by name."""
        kept = {k: v for k, v in self.tuned.values.items() if k != "T"}
        return {"Kp": self.tuned.Kp, "Ki": self.tuned.Ki, **kept}


def controller(
    scenario: Scenario | str | Path,
    structure: str,
    *,
    name: str | None = None,
    ms_db: float | None = None,
    bandwidth: float = 0.0,
    off: float = OFF,
    progress: Callable[[float], None] = lambda fraction: None,
) -> Controller:
    """Replace the controllers of a scenario by one tuned controller.

    One new unit replaces all units between the measured output and the command. The new unit has the same reference,
    measured output and feed-forward as inputs. The new controller is tuned for the loops of all cases, for the
    incremental gains (`slopes`) and delays in `[margins]` of the scenario, and for shifted natural frequencies (see
    `hystfmu.design.race`).

    Parameters
    ----------
    scenario : Scenario or path
        Scenario with a loop.
    structure : str
        Name of the controller structure: integral, integral_roll_off, pi, notch, pi_notch, irc, ppf, internal_model or
        h_infinity.
    name : str, optional
        Name of the new scenario; by default the old name followed by the structure.
    ms_db : float in [0.5, 20], optional
        Largest allowed peak of the sensitivity (dB) in the first case. The default is the limit in `[margins]` of the
        scenario, or 6 dB if there is no limit.
    bandwidth : float in [0, inf)
        Required bandwidth (Hz). The sensitivity must be below -3 dB up to this frequency.
    off : float
        Largest relative error of the natural frequencies of the plant, in [0, 0.9].
    progress : function, optional
        Function that is called with the completed fraction of the work, 0 to 1.

    Returns
    -------
    Controller

    Raises
    ------
    InputError
        The structure is unknown, the scenario has no loop, the controllers do not form one path, or no gain meets the
        limits.
    """
    if structure not in STRUCTURES:
        raise InputError(f"The 'structure' of controller() must be one of {', '.join(STRUCTURES)}. Got {structure!r}.")
    if not 0 <= off <= 0.9:
        raise InputError(f"The 'off' of controller() must be a float in [0, 0.9]. Got {off} instead.")
    loop = scenario if isinstance(scenario, Scenario) else Scenario.load(scenario)
    ready, table = loop.ready(), loop.table
    systems = {c.name: build(c) for c in ready.cases}
    first, opened = first_loop(systems, ready.spec.margins.case if ready.spec.margins else None)
    of = roles(opened)
    old = controllers(systems[first], of)
    said = {c["name"]: c for c in table.get("case", ())}
    kept = [n for n in systems if not depends(said.get(n, {}), old)]
    if first not in kept:
        raise InputError(f"{loop.name}: The first case with a loop must not change its controllers. Got {first}.")
    unit = structure if structure not in table["units"] or structure in old.units else f"{structure}_controller"

    def with_unit(graph: Graph | Node, text: str) -> Scenario:
        made = replaced(loop, of, old, unit, graph, text, kept)
        words = f"{table.get('text', '')} Controller: {text}.".strip()
        return made.changed({**made.table, "name": name or f"{table['name']}_{structure}", "text": words})

    nominal = opened.nominal
    trial = with_unit(Node(unit, "pid", {}, {"Kp": 1.0, "Ki": 0.0}), "gain of 1")
    found, slopes = _corners(trial, first, systems, off, nominal)
    design = known(found[0].opened)
    ms_db = ms_db or (ready.spec.margins.Ms_db if ready.spec.margins else None) or MS_DB
    limits = Limits(ms_db, SET_MS_DB, bandwidth)
    progress(0.2)
    if STRUCTURES[structure].resonant and not any(f * design.h < 0.4 for f in design.plant.f_n):
        raise InputError(
            f"{loop.name}: The structure {structure} needs a mode of the plant. Got a plant without modes."
        )
    plants = loop_plants(found, slopes)
    tuned = tune(STRUCTURES[structure], plants, design, aim(systems[first], of), limits)
    if tuned is None:
        raise InputError(
            f"{loop.name}: Ms of {structure} must be at most {limits.ms_db:g} dB, and {SET_MS_DB:g} dB in "
            f"{len(plants.plants)} loops with modes shifted by {100 * off:g} %. Got no gain with this property."
        )
    if tuned.bandwidth < bandwidth:
        raise InputError(
            f"{loop.name}: The bandwidth of {structure} must be at least {bandwidth:g} Hz. Got at most "
            f"{tuned.bandwidth:.3g} Hz."
        )
    progress(0.6)
    graph = _for_gain(tuned.structure.graph(design, tuned.values, tuned.Ki, _limits(systems[first], old)), nominal)
    made = with_unit(graph, f"{tuned.structure.text}, tuned over {len(plants.plants)} loops")
    results = run(made, engine="native", progress=lambda x: progress(0.6 + 0.2 * x))
    before = run(loop, case=kept, engine="native", progress=lambda x: progress(0.8 + 0.2 * x))
    errors = {r.case: r.value() for r in before}
    return Controller(made, tuned, made.open_loop(first).margins(), len(plants.plants), errors, results)


def _corners(
    trial: Scenario, first: str, systems: dict[str, System], off: float, nominal: float
) -> tuple[list[Corner], tuple[float, float]]:
    """Return all loops for which the controller is designed, and the sector of the incremental gain over `nominal`.

    In these loops, the controller has the gain 1.
    """
    ready = trial.ready()
    stated = ready.spec.margins.slopes if ready.spec.margins is not None else None
    loops: dict[str, OpenedLoop] = {}
    for c in sorted(ready.cases, key=lambda c: c.name != first):
        try:
            along = (1.0, 1.0) if stated else open_loop(systems[c.name]).slopes
            loops[c.name] = open_loop(build(c), along)
        except InputError:
            if c.name == first:
                raise
    return corners(loops, ready.spec.margins, off, stable=False), sector(loops, stated, nominal)


def _limits(system: System, old: Controllers) -> tuple[float, float] | None:
    """Return the limits of the command in the old controllers, or None if they have no limits."""
    for p in system.parts:
        if p.name in old.units:
            for n in p.own.nodes:
                if {"u_min", "u_max"} <= {v.name for v in n.block.parameters}:
                    low, high = (float(n.value(k)[0]) for k in ("u_min", "u_max"))
                    if math.isfinite(low) or math.isfinite(high):
                        return low, high
    return None


def _for_gain(graph: Graph, nominal: float) -> Graph:
    """Return a controller in which the control error is divided by the nominal incremental gain of the plant."""
    if nominal == 1.0:
        return replace_step(graph)
    error = next(n for n in graph.nodes if n.name == "error")
    k = error.value("k").copy()
    k[:2] /= nominal
    return replace_step(graph.replace(replace(error, values={**error.values, "k": k.tolist()})))


def replace_step(graph: Graph) -> Graph:
    """Return a graph without a step of its own, so that the graph uses the step of its scenario."""
    return Graph(graph.nodes, graph.wires, graph.inputs, graph.outputs, sort=False)
