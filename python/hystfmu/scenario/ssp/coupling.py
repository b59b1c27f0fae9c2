"""A case in the form in which readers of an SSP archive run it, and its difference from the original case.

fmpy, libcosim, ecos and containers of fmu-manipulation-toolbox step all components in parallel with the values of the
previous step (Jacobi). They use one step size and no events within steps. During the initialisation, libcosim and ecos
pass outputs on repeatedly, including to components that are earlier in the order. Therefore neighbouring units are
joined to one component, so that readers keep the order of these units.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import groupby

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.model import Model
from hystfmu.scenario.engine.simulation import simulate
from hystfmu.scenario.outcome.trace import Stopped, Trace
from hystfmu.scenario.system.build import build
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.fused import fuse, segments
from hystfmu.scenario.system.spec import UnitSpec
from hystfmu.scenario.system.system import System


def as_readers_run(case: Case) -> Case:
    """Return the case with Jacobi coupling at the base step.

    Iterative coupling, units of different rates, substeps and a first-order hold are an InputError, because no reader
    implements them.
    """
    if case.coupling.scheme == "iterative":
        raise InputError(f"{case.where}: the coupling is iterative: no reader of SSP archives iterates")
    slow = [name for name, u in case.units.items() if u.every > 1]
    if slow:
        raise InputError(f"{case.where}: {slow[0]} runs once in several steps: SSP has one step")
    own = [name for name, u in case.units.items() if u.substeps > 1 or u.hold != "zero"]
    if own:
        raise InputError(f"{case.where}: {own[0]} has substeps or a hold of its own: SSP knows neither")
    coupling = case.coupling.model_copy(update={"scheme": "jacobi", "events": "grid"})
    return replace(case, ripple=1, coupling=coupling)


def run_as_readers(system: System) -> Trace:
    """Return the trajectory of a case from `as_readers_run`, with consistent initial values.

    An InputError means that the run does not reach its end, or that the units have no consistent initial values.
    """
    try:
        begins, short = system.starts(), replace(system.case, stop=0.0)
        for _ in range(len(system.parts) + 1):
            trace = simulate(replace(system, case=short, begins=tuple(begins)), "native")
            last, begins = begins, trace.values[0]
            if np.array_equal(last, begins):
                return simulate(replace(system, begins=tuple(begins)), "native")
        raise InputError(f"{system.case.where}: the initial values of its units do not agree: an algebraic loop")
    except Stopped as e:
        raise InputError(
            f"{system.case.where}: with the coupling of SSP readers (Jacobi): {e}; one FMU (-o X.fmu) keeps the order"
        ) from None


def differences(case: Case, names: Mapping[str, str], trace: Trace) -> dict[str, float]:
    """Return the largest difference between the trajectories of archive and case, for each recorded output.

    `names` contains the name of each output of the case in the archive. The difference is in percent of the span of the
    output in the case. For a constant output, it is in percent of the largest value. Stopped is raised if the case does
    not run.
    """
    own = simulate(build(case), "native")
    found = {}
    for name in case.record or names:
        want = own[name][:: case.ripple]
        span = float(np.ptp(want)) or float(np.abs(want).max()) or 1.0
        found[name] = 100 * float(np.abs(trace[names[name]] - want).max()) / span
    return found


def _groups(system: System) -> list[tuple[int, ...]]:
    """Return groups of neighbours between foreign FMUs.

    A group is split if it would have an algebraic loop within one graph.
    """
    found: list[tuple[int, ...]] = []
    for foreign, run in groupby(range(len(system.parts)), lambda k: isinstance(system.parts[k].graph, Foreign)):
        parts = tuple(run)
        if foreign:
            found += [(k,) for k in parts]
            continue
        try:
            fuse(system, parts)
            found.append(parts)
        except InputError:
            found += [g for g in segments(system, cut=False) if g[0] in parts]
    return found


def joined(system: System) -> tuple[Case, dict[str, str]]:
    """Return the case of a system with one step. Neighbours that can step as one graph become one unit.

    Outputs and recorded signals have names of the form `unit_output`. Also return these names by the names in the
    system.
    """
    case, groups = system.case, _groups(system)
    units: dict[str, UnitSpec] = {}
    attached = dict(case.attached)
    places: dict[tuple[int, int], str] = {}  # (part, input) to `component.input`
    names: dict[str, str] = {}
    constants: dict[str, dict[str, float]] = {}
    for group in groups:
        parts = [system.parts[k] for k in group]
        first = parts[0]
        if isinstance(first.graph, Foreign):
            unit, constants[first.name] = first.name, first.constants
            attached[unit] = first.graph.path
            units[unit] = UnitSpec.model_validate({"fmu": unit, "set": dict(first.graph.settings)})
            names |= {f"{unit}.{o}": f"{unit}.{o}" for o in first.outputs}
            places |= {(group[0], i): f"{unit}.{name}" for i, name in enumerate(first.inputs)}
            continue
        graph, outside = fuse(system, group)
        unit = case.scenario if len(groups) == 1 else f"{first.name}_to_{parts[-1].name}" if parts[1:] else first.name
        attached[unit] = Model(unit, graph, case.step)
        units[unit] = UnitSpec.model_validate({"model": unit, "as": first.runs_as})
        names |= {f"{p.name}.{o}": f"{unit}.{p.name}_{o}" for p in parts for o in p.outputs}
        for k, i in outside:
            part = system.parts[k]
            places[k, i] = f"{unit}.{part.name}_{part.inputs[i]}"
            if (value := part.constants.get(part.inputs[i])) is not None:
                constants.setdefault(unit, {})[f"{part.name}_{part.inputs[i]}"] = value
    units = {name: u.model_copy(update={"inputs": constants.get(name, {})}) for name, u in units.items()}
    ends = {place: names[end] for end, place in system.columns.items()}
    new = replace(
        case,
        order=tuple(units),
        units=units,
        connections={places[n.to, n.input]: ends[n.source] for n in system.links if (n.to, n.input) in places},
        record=tuple(names[end] for end in case.record),
        metrics={},
        loops=(),
        overrides={},
        attached=attached,
    )
    return new, names
