"""Run a scenario by every engine; their results must have the same bits."""

from __future__ import annotations

from pathlib import Path

from hystfmu.scenario import Scenario, build, simulate
from hystfmu.scenario.engine.master import ENGINES
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.system.system import System


def ready(folder: Path) -> System:
    """Return the first case of the scenario in a folder, ready to run."""
    return build(Scenario(folder).cases[0])


def same(*systems: System) -> Trace:
    """Run the systems by every engine and return one trace; all have the same bits and the same number of sweeps."""
    traces = [simulate(system, engine) for system in systems for engine in ENGINES]
    assert len({t.values.tobytes() for t in traces}) == 1
    assert len({(t.sweeps.all, t.sweeps.most) for t in traces}) == 1
    return traces[0]
