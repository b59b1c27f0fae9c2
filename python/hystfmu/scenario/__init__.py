"""Closed-loop scenarios: read a scenario.toml, run its cases, compare them with limits and baseline, report."""

from __future__ import annotations

from hystfmu.scenario.engine.master import Engine
from hystfmu.scenario.engine.simulation import chunks, simulate
from hystfmu.scenario.outcome.trace import Trace
from hystfmu.scenario.run_scenarios import run_scenarios
from hystfmu.scenario.system.case import Scenario
from hystfmu.scenario.system.fused import to_graph
from hystfmu.scenario.system.system import build
from hystfmu.scenario.verdict.baseline import Change
from hystfmu.scenario.verdict.judge import Verdict
from hystfmu.scenario.verdict.result import Result

__all__ = [
    "Change",
    "Engine",
    "Result",
    "Scenario",
    "Trace",
    "Verdict",
    "build",
    "chunks",
    "run_scenarios",
    "simulate",
    "to_graph",
]
