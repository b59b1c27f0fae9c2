"""Study of a loop of `start`: it draws devices around the fitted model, and computes the share within the limits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hystfmu.base.files import write_toml
from hystfmu.design.plants import LEAST_SPREAD, LESS_DAMPED, SIGMAS
from hystfmu.start.closed_loop import ClosedLoop
from hystfmu.start.device import DYNAMICS_NAME, Device
from hystfmu.start.loop import GAIN

WIDTH = 0.1  # by which thresholds differ; gain and modes as in the draws of the loop
DRAWS = 200


def write_study(path: Path, loop: ClosedLoop, scenario: str, name: str) -> bool:
    """Write a study file, and return whether the model has parameters that can be drawn.

    Parameters
    ----------
    path : Path
        Path of the file, in the parent folder of the scenario.
    loop : ClosedLoop
        Loop. The limit of each drawn device is the largest limit of the drawn devices in the scenario.
    scenario : str
        Name of the folder of the scenario.
    name : str
        Name of the device.
    """
    parameters = drawn(loop.device)
    limits = [r.system.case.metrics["tracking"].limit for r in loop.results if r.case not in loop.references]
    known = [v for v in limits if v is not None]
    if not parameters or not known:
        return False
    case = loop.promises[0].name
    content = {
        "name": f"{name}_devices",
        "text": "What share of the devices stays bounded if gain, dynamics and loop width are drawn around the model?",
        "scenario": scenario,
        "cases": [case],
        "method": "random",
        "n": DRAWS,
        "seed": "run",
        "limits": {case: {"tracking": max(known)}},
        "parameters": parameters,
    }
    write_toml(path, content, f"Devices around the fitted model: hystfmu study {path} -o {path.parent / 'devices'}")
    return True


def drawn(found: Device) -> dict[str, dict[str, Any]]:
    """Return the drawn parameters with their ranges.

    These are gain, natural frequency, damping and width of the loops, if the model has such parameters.
    """
    graph = found.model.graph
    ranges: dict[str, dict[str, Any]] = {}
    if len(found.plant.f_n) == 1:
        (f_n,), (zeta,), ((f_se, _, _),) = found.plant.f_n, found.plant.zeta, found.errors
        ranges[f"plant.{DYNAMICS_NAME}"] = {
            "second_order": {
                "gain": _around(1.0, GAIN),
                "f_n": _around(f_n, max(SIGMAS * f_se / f_n, LEAST_SPREAD)),
                "zeta": _around(zeta, 1 - LESS_DAMPED),
            }
        }
    last = graph.node(graph.outputs[0].source.split(".")[0])
    if not ranges and last.type == "scaling" and last.dims == {"n": 1}:
        ranges[f"plant.{last.name}_gain"] = {"scale": _around(1.0, GAIN)}
    for n in graph.nodes:
        if n.block.rate == "hysteretic" and any(v.name == "r" for v in n.block.parameters):
            ranges[f"plant.{n.name}_r"] = {"scale": _around(1.0, WIDTH)}
    return ranges


def _around(value: float, share: float) -> list[float]:
    return [float(f"{value * (1 + sign * share):.6g}") for sign in (-1, 1)]
