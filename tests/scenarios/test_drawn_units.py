"""Drawn foreign FMUs, all types of variables: both engines, an SSP archive and a container have the same bits.

An engine refuses unsupported features in one line that names the unit; nothing is omitted silently.
"""

import random
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from drawn_unit import Variable, bounds, drawn, drawn_fmu, value
from engines import boxed, ready
from fmpy.fmi1 import FMICallException

from hystfmu.base.errors import InputError
from hystfmu.cli import main
from hystfmu.scenario.engine.simulation import ENGINES, chunks_here
from hystfmu.scenario.outcome.trace import Stopped, Trace
from hystfmu.scenario.ssp.read import read_ssp
from hystfmu.scenario.system.system import System, build

H, STEPS = 1e-3, 20
REAL = {"Real", "Float64", "Float32"}


def fits(source: str, kind: str) -> bool:
    """Whether an input of the type `kind` takes every number of an output."""
    if kind in REAL or kind == "Boolean" or source == "Boolean":
        return True
    if source in REAL or "Enumeration" in (source, kind):
        return source == kind == "Enumeration" or (source in REAL and not kind.startswith("U"))
    (low, high), (least, most) = bounds(source), bounds(kind)
    return (least <= low and high < most) or (least <= low and high <= most < 2**53)


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
            if rng.random() < 0.1:
                unit |= rng.choice([{"substeps": 2}, {"every": 2}])
            size = None
            for v in variables:
                if v.causality == "structuralParameter" and rng.random() < 0.5:
                    size = unit["set"][v.name] = rng.randint(1, 4)
                if v.causality == "parameter" and rng.random() < 0.7:
                    drawn_values = [value(rng, v.type) for _ in v.elements(size)]
                    unit["set"][v.name] = drawn_values if v.is_array else drawn_values[0]
                if v.causality == "input" and v.type != "String":
                    for element in v.elements(size):
                        sources = [end for end, kind in ends if fits(kind, v.type) or rng.random() < 0.03]
                        if sources and rng.random() < 0.6:
                            connections[f"{name}.{element}"] = rng.choice(sources)
                        elif rng.random() < 0.5:
                            unit["inputs"][element] = float(value(rng, v.type, exact=False))
            units[name] = unit
            ends += [(f"{name}.{e}", v.type) for v in variables if v.causality == "output" for e in v.elements(size)]
        ends = [(end, kind) for end, kind in ends if kind != "String"]
        record = [end for end, _ in ends]
        return {
            "name": "drawn", "step": H, "stop": STEPS * H, "order": list(units), "units": units,
            "connections": {to: of for to, of in connections.items() if of in record}, "record": record,
            "metrics": {"p": {"kind": "final", "signal": record[-1]}},
            "coupling": {"scheme": rng.choice(("gauss_seidel", "jacobi"))},
        }  # fmt: skip


def written(folder: Path, out: Path) -> str:
    """Write an archive by the command line; return "" or the line of a refusal."""
    result = CliRunner().invoke(main, ["ssp", str(folder), "--separate", "-o", str(out)])
    if result.exit_code < 2 and out.exists():  # 1: what the coupling of readers costs is no refusal
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
        return str(e)


def same(one: Trace | str, other: Trace | str) -> None:
    if isinstance(one, str) or isinstance(other, str):
        assert one == other
        return
    for end in one.columns:
        assert one[end].tobytes() == other[end].tobytes(), end


def without(data: dict[str, Any], line: str) -> None:
    """Take what a line refuses out of a scenario; the line names the unit, and the variable."""
    if found := re.search(r"\b(x[0-9]+) must (?:have no substeps|run in every step)", line):
        for key in ("substeps", "every"):
            data["units"][found[1]].pop(key, None)
        return
    found = re.search(r"\b(x[0-9]+)(?:\.(?:set\.)?| refuses .*: | cannot be .*: )([puy][0-9][_0-9]*)\b", line)
    assert found, line
    unit, name = found.groups()
    own = re.compile(rf"(?:{unit}\.)?{name}(?:_[0-9]+)?")
    places = [data["connections"], data["units"][unit]["set"], data["units"][unit]["inputs"]]
    taken = [place.pop(key) for place in places for key in list(place) if own.fullmatch(key)]
    assert taken, line


def compared(draw: Draw, write: Any, tmp_path: Path) -> list[str]:
    """Every way to run a scenario of drawn units; return the lines of what was refused and taken out."""
    data, refused = draw.data(), list[str]()
    folder = write(data)
    for name, (fmi, variables) in draw.units.items():
        drawn_fmu(folder / f"{name}.fmu", fmi, variables)
    for attempt in range(100):
        line = one_attempt(write(data), data, tmp_path / f"{attempt}")
        if not line:
            return refused
        refused.append(line)
        without(data, line)
    raise AssertionError(refused)


def one_attempt(folder: Path, data: dict[str, Any], out: Path) -> str:
    """Run a scenario in every way; return the line of the first refusal, or "" if all ways have the same bits."""
    try:
        system = ready(folder)
    except InputError as e:
        return str(e)
    ours, other = (run(system, engine) for engine in ENGINES)
    same(ours, other)
    out.mkdir()
    line = written(folder, out / "box.fmu")
    if isinstance(ours, str):
        if not line:
            with pytest.raises(FMICallException):
                boxed(out / "box.fmu", out / "box", H, STEPS)
        return ours
    if line:
        return line
    got = boxed(out / "box.fmu", out / "box", H, STEPS)
    assert set(ours.columns) == set(got)
    for end in ours.columns:
        assert got[end].tobytes() == ours[end].tobytes(), end
    if line := written(folder, out / "box.ssp"):
        return line
    jacobi = replace(system.case, coupling=system.case.coupling.model_copy(update={"scheme": "jacobi"}))
    want = run(build(jacobi), "native")
    again = build(read_ssp(out / "box.ssp").case)
    for engine in ENGINES:
        same(want, run(again, engine))
    return ""


@pytest.mark.turn("compiled loops")
@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.stress) for k in range(1, 50))])
def test_drawn_units(write: Any, tmp_path: Path, seed: int) -> None:
    """Six units in a scenario: 300 in all."""
    for line in compared(Draw(random.Random(seed), 6), write, tmp_path):
        print(line)


@pytest.mark.parametrize(("fmi", "kind"), [(2, "Boolean"), (3, "Float64"), (3, "Boolean")])
def test_a_unit_that_ends_the_simulation(write: Any, tmp_path: Path, fmi: int, kind: str) -> None:
    """Called directly or by types, in an engine or a container: it is not stepped on."""
    folder = write(
        {"name": "ended", "step": H, "stop": 5 * H, "order": ["x0"], "units": {"x0": {"fmu": "x0.fmu"}},
         "metrics": {"p": {"kind": "final", "signal": "x0.y0"}}}
    )  # fmt: skip
    drawn_fmu(folder / "x0.fmu", fmi, [Variable("y0", kind, "output", (value(random.Random(1), kind),))], 3)
    system = ready(folder)
    for engine in ENGINES:
        line = run(system, engine)
        assert isinstance(line, str)
        assert line.startswith("x0 refuses the step from t = 0.002 s: ")
    assert not written(folder, tmp_path / "box.fmu")
    with pytest.raises(FMICallException):
        boxed(tmp_path / "box.fmu", tmp_path / "box", H, 3)
    assert len(boxed(tmp_path / "box.fmu", tmp_path / "again", H, 2)["x0.y0"]) == 3
