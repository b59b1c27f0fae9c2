"""The study of a started loop: devices drawn around the fitted model, and the share of them that the loop holds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hystfmu.base.files import write_toml
from hystfmu.design.sector import static_gain
from hystfmu.graph import Node
from hystfmu.start.device import FREQUENCY, GAIN, Device
from hystfmu.start.loop import CORNER

WIDTH, DAMPING = 0.1, 0.3  # by which thresholds and damping ratio differ; gain and frequencies as in the corners
DRAWS = 200
CASE = "sine"


def write_study(path: Path, found: Device, percent: float, scenario: str, name: str) -> bool:
    """Write a study file; return whether the model has parameters that can be drawn.

    Parameters
    ----------
    path : Path
        Of the file, beside the folder of the scenario.
    found : Device
    percent : float
        Largest RMS error of the loop that is asked for, in percent of the stroke; that of a drawn device is `CORNER`
        times as large.
    scenario : str
        Name of the folder of the scenario.
    name : str
        Of the device.
    """
    parameters = drawn(found)
    if not parameters:
        return False
    content = {
        "name": f"{name}_devices",
        "text": "What share of the devices works, if they differ from the model by what is drawn?",
        "scenario": scenario,
        "cases": [CASE],
        "method": "random",
        "n": DRAWS,
        "seed": "run",
        "limits": {CASE: {"tracking": CORNER * percent}},
        "parameters": parameters,
    }
    write_toml(path, content, f"Devices around the fitted model: hystfmu study {path} -o {path.parent / 'devices'}")
    return True


def drawn(found: Device) -> dict[str, dict[str, Any]]:
    """Return what is drawn, with its range: gain, natural frequency and damping, width of the loops.

    What a model has no parameter for is not drawn.
    """
    graph = found.model.graph
    ranges: dict[str, dict[str, Any]] = {}
    second = [n for n in found.dynamics if n.dims == {"nb": 0, "na": 2} and static_gain(n) > 0]
    for n in second:
        gain, f_n, zeta = _second_order(n)
        near = GAIN if n is second[0] else 1e-3
        ranges[f"plant.{n.name}"] = {
            "second_order": {
                "gain": _around(gain, near), "f_n": _around(f_n, FREQUENCY), "zeta": _around(zeta, DAMPING)
            }
        }  # fmt: skip
    last = graph.node(graph.outputs[0].source.split(".")[0])
    if not second and last.type == "scaling" and last.dims == {"n": 1}:
        ranges[f"plant.{last.name}_gain"] = {"scale": _around(1.0, GAIN)}
    for n in graph.nodes:
        if n.block.rate == "hysteretic" and any(v.name == "r" for v in n.block.parameters):
            ranges[f"plant.{n.name}_r"] = {"scale": _around(1.0, WIDTH)}
    return ranges


def _second_order(node: Node) -> tuple[float, float, float]:
    """Return static gain, natural frequency (Hz) and damping ratio of a second-order transfer function."""
    a2, a1, a0 = node.value("a")
    w = np.sqrt(a0 / a2)
    return static_gain(node), float(w / (2 * np.pi)), float(a1 / a2 / (2 * w))


def _around(value: float, share: float) -> list[float]:
    return [float(f"{value * (1 + sign * share):.6g}") for sign in (-1, 1)]
