"""Drawn foreign FMUs, all types of variables: both engines, an SSP archive and a container have the same bits.

What one of them cannot do it refuses in one line that names the unit; nothing is left out or differs without a word.
"""

from __future__ import annotations

import random
import re
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from click.testing import CliRunner
from drawn_unit import Variable, bounds, drawn, drawn_fmu, value
from engines import ready
from fmpy.fmi2 import FMU2Slave

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.cli import main
from hystfmu.scenario.engine.master import ENGINES, chunks_here
from hystfmu.scenario.outcome.trace import Stopped, Trace
from hystfmu.scenario.ssp.read import read_ssp
from hystfmu.scenario.system.system import System, build

H, STEPS = 1e-3, 20
REAL = {"Real", "Float64", "Float32"}


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HYSTFMU_CACHE", str(tmp_path / "cache"))


def fits(source: str, kind: str) -> bool:
    """Whether an input of the type `kind` takes every number of an output."""
    if kind in REAL or kind == "Boolean" or source == "Boolean":
        return True
    if source in REAL or "Enumeration" in (source, kind):
        return source == kind == "Enumeration" or (source in REAL and not kind.startswith("U"))
    (low, high), (least, most) = bounds(source), bounds(kind)
    return least <= low and high < most or (least <= low and high <= most < 2**53)


class Draw:
    """A scenario of drawn units behind a sine."""

    def __init__(self, rng: random.Random, n: int) -> None:
        self.rng = rng
        self.units = {f"x{k}": (rng.choice((2, 3)), []) for k in range(n)}
        for fmi, variables in self.units.values():
            variables += drawn(rng, fmi)

    def data(self) -> dict[str, Any]:
        """The scenario; its random parts are drawn anew by every call."""
        rng = self.rng
        reference = {"shape": "sine", "amplitude": 3.0, "frequency": 60.0}
        units: dict[str, Any] = {"reference": {"block": "reference", "values": reference}}
        connections: dict[str, str] = {}
        ends: list[tuple[str, str]] = [("reference.r", "Real")]
        for name, (_, variables) in self.units.items():
            unit: dict[str, Any] = {"fmu": f"{name}.fmu", "set": {}, "inputs": {}}
            for v in variables:
                if v.causality == "parameter" and rng.random() < 0.7:
                    array = len(v.start) > 1
                    if not array:
                        unit["set"][v.name] = value(rng, v.type)
                    elif v.type in REAL:
                        unit["set"][v.name] = [value(rng, v.type) for _ in v.start]
                if v.causality == "input" and v.type != "String":
                    for element in v.elements:
                        sources = [end for end, kind in ends if fits(kind, v.type)]
                        if sources and rng.random() < 0.6:
                            connections[f"{name}.{element}"] = rng.choice(sources)
                        elif rng.random() < 0.5:
                            unit["inputs"][element] = float(value(rng, v.type, exact=False))
            units[name] = unit
            ends += [(f"{name}.{e}", v.type) for v in variables if v.causality == "output" for e in v.elements]
        ends = [(end, kind) for end, kind in ends if kind != "String"]
        record = [end for end, _ in ends]
        return {
            "name": "drawn",
            "step": H,
            "stop": STEPS * H,
            "order": list(units),
            "units": units,
            "connections": {to: of for to, of in connections.items() if of in record},
            "record": record,
            "metrics": {"p": {"kind": "final", "signal": record[-1]}},
            "coupling": {"scheme": rng.choice(("gauss_seidel", "jacobi"))},
        }


def stepped(fmu: Path, folder: Path) -> dict[str, Array]:
    """All outputs of a container, row by row."""
    description = fmpy.read_model_description(str(fmu))
    slave = FMU2Slave(
        guid=description.guid,
        modelIdentifier=description.coSimulation.modelIdentifier,
        unzipDirectory=fmpy.extract(str(fmu), str(folder)),
        instanceName="box",
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    rows = []
    for k in range(STEPS + 1):
        if k:
            slave.doStep((k - 1) * H, H)
        rows.append(
            [float(getattr(slave, f"get{v.type}")([v.valueReference])[0]) for v in description.modelVariables]
        )
    slave.terminate()
    slave.freeInstance()
    return {v.description: x for v, x in zip(description.modelVariables, np.array(rows).T, strict=True)}


def written(folder: Path, out: Path) -> str:
    """Write an archive by the command line; return "" or the line of a refusal."""
    result = CliRunner().invoke(main, ["ssp", str(folder), "-o", str(out)])
    if result.exit_code == 0:
        return ""
    assert result.exit_code == 2, (result.output, result.exception)
    assert len(result.output.splitlines()) == 1, result.output
    assert not out.exists()
    return result.output.strip()


def run(system: System, engine: Any) -> Trace | str:
    """The trajectory by an engine, or the line with which it stops."""
    try:
        return Trace.joined(chunks_here(system, engine), system.n_steps + 1)
    except Stopped as e:
        assert "\n" not in str(e)
        return str(e)


def same(one: Trace | str, other: Trace | str) -> None:
    if isinstance(one, str) or isinstance(other, str):
        assert one == other
        return
    for end in one.columns:
        assert one[end].tobytes() == other[end].tobytes(), end


def compared(draw: Draw, write: Any, tmp_path: Path) -> dict[str, int]:
    """Every way to run a scenario of drawn units; what is refused is counted by its reason."""
    data, refused = draw.data(), dict[str, int]()
    folder = write(data)
    for name, (fmi, variables) in draw.units.items():
        drawn_fmu(folder / f"{name}.fmu", fmi, variables)
    system = ready(folder)
    ours, other = (run(system, engine) for engine in ENGINES)
    same(ours, other)
    if isinstance(ours, str):
        return {re.sub(r"[0-9.e+-]+", "#", ours): 1}
    line = written(folder, tmp_path / "box.fmu")
    if line:
        refused[f"container: {line}"] = 1
    else:
        got = stepped(tmp_path / "box.fmu", tmp_path / "box")
        assert set(ours.columns) == set(got)
        for end in ours.columns:
            assert got[end].tobytes() == ours[end].tobytes(), end
    line = written(folder, tmp_path / "box.ssp")
    if line:
        refused[f"ssp: {line}"] = 1
        return refused
    data["coupling"]["scheme"] = "jacobi"
    want = run(ready(write(data)), "native")
    again = build(read_ssp(tmp_path / "box.ssp").case)
    for engine in ENGINES:
        same(want, run(again, engine))
    return refused


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.stress) for k in range(1, 50))])
def test_drawn_units(write: Any, tmp_path: Path, seed: int) -> None:
    refused = compared(Draw(random.Random(seed), 6), write, tmp_path)
    print(refused)
