"""Replace the controllers of a scenario by a controller of a named structure, tuned for all loops of the scenario."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from hystfmu.base.errors import InputError
from hystfmu.design.loop import Margins
from hystfmu.design.race import Limits, Tuned, tune
from hystfmu.design.structures import STRUCTURES
from hystfmu.face.scenario import Scenario
from hystfmu.graph import Graph, Node
from hystfmu.redesign.corners import Corner, aim, corners, known, loop_plants, sector
from hystfmu.redesign.replace import Controllers, controllers, depends, replaced
from hystfmu.redesign.roles import roles
from hystfmu.scenario import Results, build, run
from hystfmu.scenario.loop.opened import OpenedLoop
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.scenario.system.spec import ScenarioSpec
from hystfmu.scenario.system.system import System

MS_DB, SET_MS_DB = 6.0, 12.0
OFF = 0.05


@dataclass(frozen=True)
class Controller:
    """A loop with a new controller, and the results of the loop.

    Attributes
    ----------
    scenario : Scenario
        Scenario with the controller as one unit of blocks.
    tuned : Tuned
        Structure and gains, peaks of the sensitivity, and bandwidth.
    margins : Margins
        Margins of the first case.
    loops : int
        Number of loops for which the controller was tuned.
    before : dict of str to float
        Error of each case with the old controllers: value of the first metric.
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
        """Gains and values of the structure by name."""
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
    """Replace the controllers of a scenario by a tuned controller.

    One new unit replaces all units between the measured output and the command. The new unit reads the same reference,
    measurement and feed-forward. `hystfmu.design.race` tunes it for the loops of all cases, for the slopes and delays
    in `[margins]` of the scenario, and for shifted natural frequencies.

    Parameters
    ----------
    scenario : Scenario or path
        Scenario with a loop.
    structure : str
        integral, integral_roll_off, pi, notch, pi_notch, irc, ppf, internal_model or h_infinity.
    name : str, optional
        Name of the new scenario; by default the old name followed by the structure.
    ms_db : float in [0.5, 20], optional
        Largest allowed peak of the sensitivity of the first case (dB). The default is the limit in `[margins]`, or 6.
    bandwidth : float in [0, inf)
        Required bandwidth (Hz): the sensitivity must be below -3 dB up to this frequency.
    off : float
        Share by which the natural frequencies of the plant may differ, in [0, 0.9].
    progress : function, optional
        Called with the fraction done, 0..1.

    Returns
    -------
    Controller

    Raises
    ------
    InputError
        The structure is unknown, there is no loop, the controllers do not form one path, or no gain meets the limits.
    """
    if structure not in STRUCTURES:
        raise InputError(f"The 'structure' of controller() must be one of {', '.join(STRUCTURES)}. Got {structure!r}.")
    if not 0 <= off <= 0.9:
        raise InputError(f"The 'off' of controller() must be a float in [0, 0.9]. Got {off} instead.")
    loop = scenario if isinstance(scenario, Scenario) else Scenario.load(scenario)
    ready, table = loop.ready(), loop.table
    systems = {c.name: build(c) for c in ready.cases}
    first, opened = _nominal(systems, ready.spec)
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

    found, slopes = _corners(with_unit(Node(unit, "pid", {}, {"Kp": 1.0, "Ki": 0.0}), "gain of 1"), first, systems, off)
    nominal = opened.nominal
    design = known(found[0].opened)
    limits = Limits(ms_db or (ready.spec.margins.Ms_db if ready.spec.margins else None) or MS_DB, SET_MS_DB)
    progress(0.2)
    if STRUCTURES[structure].resonant and not any(f * design.h < 0.4 for f in design.plant.f_n):
        raise InputError(f"{loop.name}: The structure {structure} must know a mode of the plant. Got a plant without.")
    plants = loop_plants(found, (slopes[0] / nominal, slopes[1] / nominal))
    tuned = tune(STRUCTURES[structure], plants, design, aim(systems[first], of), limits)
    if tuned is None:
        raise InputError(
            f"{loop.name}: A gain of {structure} must keep Ms below {limits.ms_db:g} dB, and {SET_MS_DB:g} dB in "
            f"{len(plants.plants)} loops with modes {100 * off:g} % off. Got none."
        )
    if tuned.bandwidth < bandwidth:
        raise InputError(
            f"{loop.name}: The bandwidth of {structure} must be at least {bandwidth:g} Hz. Reachable is "
            f"{tuned.bandwidth:.3g} Hz."
        )
    progress(0.6)
    graph = _for_gain(tuned.structure.graph(design, tuned.values, tuned.Ki, _limits(systems[first], old)), nominal)
    made = with_unit(graph, f"{tuned.structure.text}, tuned over {len(plants.plants)} loops")
    results = run(made, engine="native", progress=lambda x: progress(0.6 + 0.2 * x))
    before = run(loop, case=kept, engine="native", progress=lambda x: progress(0.8 + 0.2 * x))
    errors = {r.case: r.verdicts[0].value if r.verdicts else math.inf for r in before}
    return Controller(made, tuned, made.open_loop(first).margins(), len(plants.plants), errors, results)


def _nominal(systems: dict[str, System], spec: ScenarioSpec) -> tuple[str, OpenedLoop]:
    """Return the case in `[margins]`, else the first case with a loop, and the opened loop of this case."""
    wanted = spec.margins.case if spec.margins is not None else None
    why: InputError | None = None
    for name in systems if wanted is None else [wanted]:
        try:
            return name, open_loop(systems[name])
        except InputError as e:
            why = why or e
    assert why is not None
    raise why


def _corners(
    trial: Scenario, first: str, systems: dict[str, System], off: float
) -> tuple[list[Corner], tuple[float, float]]:
    """Return the loops with a controller of gain 1, and the sector of their slopes; the first case is first."""
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
    return corners(loops, ready.spec.margins, off, stable=False), sector(loops, stated, 1.0)


def _limits(system: System, old: Controllers) -> tuple[float, float] | None:
    """Return the limits of the command in the old controllers."""
    for p in system.parts:
        if p.name in old.units:
            for n in p.own.nodes:
                if {"u_min", "u_max"} <= {v.name for v in n.block.parameters}:
                    low, high = (float(n.value(k)[0]) for k in ("u_min", "u_max"))
                    if math.isfinite(low) or math.isfinite(high):
                        return low, high
    return None


def _for_gain(graph: Graph, nominal: float) -> Graph:
    """Return a controller for a plant whose slope is not 1. Its errors are in the unit of the command."""
    if nominal == 1.0:
        return replace_step(graph)
    error = next(n for n in graph.nodes if n.name == "error")
    k = error.value("k").copy()
    k[:2] /= nominal
    return replace_step(graph.replace(replace(error, values={**error.values, "k": k.tolist()})))


def replace_step(graph: Graph) -> Graph:
    """Return a graph with the step of its scenario, so that the file of the scenario can state the blocks."""
    return Graph(graph.nodes, graph.wires, graph.inputs, graph.outputs, sort=False)
