"""A foreign FMU as a unit of a scenario: the data of its modelDescription.xml that the master uses.

The ports of the unit are the inputs and outputs that are numbers or booleans. Unconnected inputs have their start
values during the whole run. `hystfmu run` executes the FMU in a child process.
"""

import hashlib
import json
import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from hystfmu.base import InputError
from hystfmu.fmu.archive import unpacked
from hystfmu.fmu.foreign.description import check_binary, read_description
from hystfmu.fmu.foreign.instance import CARRIED, REAL, Finding, carried, numbers, unit_of, version
from hystfmu.graph.node import element_names

MOST_PORTS = 100_000
_DIRECT = {"Real", "Float64"}  # types whose arrays are set and read without a copy
_SETTABLE = ("parameter", "structuralParameter")


@dataclass(frozen=True)
class ForeignPort:
    """A variable of a foreign FMU. An array of FMI 3.0 has several elements."""

    name: str
    kind: Literal["input", "output"]
    unit: str
    start: tuple[float, ...]
    text: str = ""
    variable: Any = None

    @property
    def size(self) -> int:
        """Number of elements."""
        return len(self.start)

    @property
    def scalar_names(self) -> tuple[str, ...]:
        """Names of the elements."""
        return element_names(self.name, self.size)


@dataclass(frozen=True)
class Foreign:
    """An unpacked foreign FMU with the parameter values of a scenario."""

    path: Path
    folder: Path
    digest: str
    description: Any
    ports: tuple[ForeignPort, ...]
    has_tangent: bool = False
    """True if the FMU provides directional derivatives in Co-Simulation."""
    settings: Mapping[str, float | bool | str | list[float]] = field(default_factory=dict)
    nodes: tuple[()] = ()

    @classmethod
    def load(cls, path: Path) -> "Foreign":
        """Unpack an FMU and read its description.

        The file must be a readable FMU 1.0, 2.0 or 3.0 for Co-Simulation or Model Exchange, with a binary for this
        platform.
        """
        folder, digest = unpacked(path)
        description, root = read_description(path, folder)
        if description.coSimulation is None and description.modelExchange is None:
            raise InputError(f"{path}: must support Co-Simulation or Model Exchange")
        check_binary(path, folder, description)
        declared = root.find("CoSimulation")  # fmpy does not read the plural of FMI 3.0
        name = "providesDirectionalDerivative"
        has_tangent = declared is not None and {declared.get(name), declared.get(f"{name}s")} & {"true", "1"} != set()
        made = cls(path, folder, digest, description, _ports(path, description, {}), has_tangent)
        return made if made.direct else replace(made, has_tangent=False)

    @property
    def fmi(self) -> Literal[1, 2, 3]:
        """FMI version."""
        return version(self.description)

    @property
    def direct(self) -> bool:
        """True if the FMU can use the arrays of the master without conversion."""
        kinds = {p.variable.type for p in self.ports}
        return self.description.coSimulation is not None and self.fmi > 1 and kinds <= _DIRECT

    @property
    def saves(self) -> bool:
        """True if the FMU can save and restore its state."""
        can = self.description.coSimulation or self.description.modelExchange
        return bool(getattr(can, "canGetAndSetFMUstate", False))

    @property
    def any_step(self) -> bool:
        """True if the FMU supports communication steps of variable size, or is integrated here (Model Exchange)."""
        simulation = self.description.coSimulation
        if simulation is None:
            return True
        if self.fmi == 1:
            return False
        fixed = getattr(simulation, "fixedInternalStepSize", None)
        return bool(simulation.canHandleVariableCommunicationStepSize) and fixed is None

    @property
    def token(self) -> str:
        """Hash of the archive and of the parameter values."""
        content = [self.digest, sorted(self.settings.items())]
        return hashlib.sha256(json.dumps(content).encode()).hexdigest()

    def dependencies(self) -> dict[str, set[str]]:
        """Inputs with declared direct feed-through to each output, or all inputs if there is no declaration."""
        inputs = {p.name for p in self.ports if p.kind == "input"}
        declared = {u.variable.name: u for u in self.description.outputs}
        found = {}
        for p in self.ports:
            if p.kind == "output":
                unknown = declared.get(p.name)
                listed = None if unknown is None else unknown.dependencies
                found[p.name] = inputs if listed is None else {v.name for v in listed} & inputs
        return found

    def with_settings(self, settings: Mapping[str, Any]) -> "Foreign":
        """Return the FMU with other parameter values of the correct types.

        ``"*1.2"`` is a factor of the start value.
        """
        variables = {v.name: v for v in self.description.modelVariables if v.causality in _SETTABLE}
        new = dict(self.settings)
        for name, value in settings.items():
            if name not in variables:
                raise InputError(f"no parameter {name!r}; there are {', '.join(list(variables)[:20]) or 'none'}")
            new[name] = _value(variables[name], value, self.settings.get(name))
        sizes = {k: x for k, x in new.items() if variables[k].causality == "structuralParameter"}
        for name, value in new.items():
            expected = _size(variables[name], sizes)
            if isinstance(value, list) and len(value) != expected:
                raise InputError(f"{name}: must have {expected} elements; got {len(value)}")
        return replace(self, settings=new, ports=_ports(self.path, self.description, sizes))


def _ports(path: Path, description: Any, sizes: Mapping[str, Any]) -> tuple[ForeignPort, ...]:
    """Return the inputs in the order of the file, then the outputs in the order of the file."""
    ports = [_port(path, v, sizes) for v in description.modelVariables if _is_port(v)]
    if sum(p.size for p in ports) > MOST_PORTS:
        raise InputError(f"{path}: more than {MOST_PORTS} inputs and outputs")
    twice = [name for name, n in Counter(n for p in ports for n in p.scalar_names).items() if n > 1]
    if twice:
        raise InputError(f"{path}: inputs and outputs must have names of their own. {twice[0]!r} occurs twice.")
    return tuple(sorted(ports, key=lambda p: p.kind))


def _is_port(v: Any) -> bool:
    return v.type in CARRIED and v.causality in ("input", "output") and not getattr(v, "clocks", None)


def _size(v: Any, sizes: Mapping[str, Any]) -> int:
    """Return the number of elements of a variable for the present values of structural parameters."""
    size = 1
    for d in v.dimensions:
        size *= int(d.start if d.variable is None else sizes.get(d.variable.name, d.variable.start))
    return size


def _port(path: Path, v: Any, sizes: Mapping[str, Any]) -> ForeignPort:
    size = _size(v, sizes)
    if not 0 < size <= MOST_PORTS:
        raise InputError(f"{path}: {v.name!r} has {size} elements; at most {MOST_PORTS} can be connected")
    try:
        start = list(numbers(v.start)) if v.start not in (None, "") else [0.0]
        if any(carried(v, x) != x for x in start if v.type not in REAL):
            raise ValueError
    except (ValueError, Finding):
        kind = "number" if v.type in REAL else f"number of the type {v.type}"
        raise InputError(f"{path}: {v.name}: the start value must be a {kind}. Got {v.start!r} instead.") from None
    if len(start) != size:
        start = start[:1] * size
    return ForeignPort(
        v.name,
        v.causality,
        unit_of(v),
        tuple(x if math.isfinite(x) or v.causality == "input" else 0.0 for x in start),
        v.description or "",
        v,
    )


def _value(v: Any, value: Any, now: Any) -> float | bool | str | list[float]:
    """Return a value in the type of its parameter, with the elements of an array in row order."""
    if v.type == "String" and not v.dimensions:
        text = str(value)
        if "\0" in text:
            raise InputError(f"{v.name}: must have no NUL character; got {text!r}")
        return text
    if v.type not in CARRIED:
        raise InputError(f"{v.name}: a parameter of type {v.type} cannot be set in a scenario")
    if v.dimensions and v.type == "String":
        raise InputError(f"{v.name}: an array of type {v.type} cannot be set in a scenario")
    if isinstance(value, str) and value.startswith("*"):
        old = now if now is not None else numbers(v.start)
        try:
            value = [float(value[1:]) * x for x in (old if isinstance(old, list | tuple) else [old])]
        except ValueError:
            raise InputError(f"{v.name}: must be a number or '*' and a number; got {value!r}") from None
        value = value if v.dimensions else value[0]
    if not v.dimensions:
        return _scalar(v, value)
    if not isinstance(value, list):
        raise InputError(f"{v.name}: must be a list of numbers or '*' and a number; got {value!r}")
    return [_scalar(v, x) for x in value]


def _scalar(v: Any, value: Any) -> float:
    if v.type == "Boolean":
        if not isinstance(value, bool) and value not in (0, 1):
            raise InputError(f"{v.name}: must be true or false; got {value!r}")
        return bool(value)
    try:
        number = value if isinstance(value, int) else float(value)
    except (TypeError, ValueError):
        raise InputError(f"{v.name}: must be a number or '*' and a number; got {value!r}") from None
    if v.type in REAL:
        return float(number)
    if not math.isfinite(number) or number != math.floor(number):
        raise InputError(f"{v.name}: must be a whole number; got {value!r}")
    try:
        return carried(v, number)
    except Finding as e:
        raise InputError(str(e)) from None
