"""Closed-loop scenarios: read a scenario.toml, run its cases, compare the results with limits and baseline."""

from hystfmu.scenario.engine.simulation import Engine, Run, chunks, simulate
from hystfmu.scenario.outcome.result import Change, Verdict
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.running import Result, Results, run
from hystfmu.scenario.system.case import Cases
from hystfmu.scenario.system.system import build, to_graph

__all__ = [
    "Cases",
    "Change",
    "Engine",
    "Result",
    "Results",
    "Run",
    "Trace",
    "Verdict",
    "build",
    "chunks",
    "run",
    "simulate",
    "to_graph",
]
