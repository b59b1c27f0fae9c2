"""Neighbouring units joined to one component each, so that readers of an SSP archive keep their order."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby

from hystfmu.base.errors import InputError
from hystfmu.model import Model
from hystfmu.scenario.system.case import Case
from hystfmu.scenario.system.foreign import Foreign
from hystfmu.scenario.system.fused import fuse, segments
from hystfmu.scenario.system.spec import UnitSpec
from hystfmu.scenario.system.system import System


def _groups(system: System) -> list[tuple[int, ...]]:
    """Groups of neighbours between foreign FMUs.

    Smaller groups if a group would have an algebraic loop within one graph.
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
    """Return the case of a system in which neighbours that can step as one graph are one unit.

    Parameters
    ----------
    system : System
        System with one step for all units; the result has the same coupling.

    Returns
    -------
    case : Case
        Outputs are called `unit_output`, and so are recorded signals.
    names : dict
        For every output of the system its name in the case.
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
