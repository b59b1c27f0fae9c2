"""Studies of gains of the shipped scenarios, and the values that the scenarios took from them."""

import tomllib
from pathlib import Path
from typing import Any

from hystfmu.graph import Graph
from hystfmu.scenario import build
from hystfmu.studies.spec import PREFIX, Study

SCENARIOS = Path(__file__).parents[1] / "scenarios"
NAMES = sorted(f.parent.relative_to(SCENARIOS).as_posix() for f in SCENARIOS.glob("**/gains.study.toml"))
STAGE = [name for name in NAMES if name.startswith("stage/")]
TRACKING = [name for name in NAMES if name not in STAGE]
OURS = ("internal_model", "repetitive")
"""What is recommended; the others are baselines."""


def study(name: str) -> Study:
    """Read the study of gains of a scenario."""
    return Study(SCENARIOS / name / "gains.study.toml")


def recorded() -> dict[str, dict[str, Any]]:
    """What each study found, by scenario."""
    return tomllib.loads((SCENARIOS / "models" / "gains.record.toml").read_text())


def graphs(of: Study) -> dict[str, Graph]:
    """Units of the first case of a study."""
    return {p.name: p.graph for p in build(of.cases[0]).parts if isinstance(p.graph, Graph)}


def values(graph: Graph, name: str) -> list[float]:
    """Return a parameter by the name that an importer uses, one element or all."""
    for port in graph.ports:
        found = [float(v) for v in graph.nodes[port.node].value(port.var.name)] if port.is_parameter else []
        if name == port.name:
            return found
        if name in port.scalar_names:
            return [found[port.scalar_names.index(name)]]
    raise KeyError(name)


def shipped(of: Study, key: str) -> list[float]:
    """Return a parameter `unit.name` as the scenario states it."""
    unit, _, name = key.partition(".")
    return values(graphs(of)[unit], name)


def drawn(name: str) -> dict[str, float]:
    """Return the values of all parameters of a study: those of the scenario, of a design those of the record."""
    of = study(name)
    return {k: recorded()[name]["values"][k] if k.startswith(PREFIX) else shipped(of, k)[0] for k in of.parameters}
