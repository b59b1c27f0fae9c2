"""Instances of an FMU of any origin, based on fmpy, with the same methods for FMI 1.0, 2.0 and 3.0.

Only child processes create instances, because the FMU executes foreign native code.
"""

import ctypes as C
import importlib
import math
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal


class Finding(Exception):
    """Exception with a finding as a sentence. It ends the trial or the run in which it occurs."""


class Ended(Finding):
    """The FMU ends the simulation by itself, which the standard permits."""


Values = tuple[float, ...]
Interface = Literal["CoSimulation", "ModelExchange", "ScheduledExecution"]
REAL = frozenset({"Real", "Float64", "Float32"})
NUMBERS = REAL | {f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)} | {"Integer", "Enumeration"}
CARRIED = NUMBERS | {"Boolean"}
"""Variable types whose values are represented as numbers."""

_KINDS = {"CoSimulation": "Slave", "ModelExchange": "Model", "ScheduledExecution": "ScheduledExecution"}  # of fmpy
_DISCARD, _TERMINATED = 2, 3  # fmi2Status, fmi2StatusKind
_TEXT = {"fmi1GetVersion", "fmi1GetTypesPlatform", "fmi1GetModelTypesPlatform"}


def version(description: Any) -> Literal[1, 2, 3]:
    """Return the major version of the FMI standard of an FMU."""
    found = {"1": 1, "2": 2, "3": 3}[str(description.fmiVersion)[0]]
    return found  # type: ignore[return-value]


def interface_of(description: Any, interface: Interface) -> Any:
    """Return the description of an interface; None if the FMU does not have this interface."""
    return getattr(description, interface[0].lower() + interface[1:])


def count(v: Any) -> int:
    """Return the number of elements of a variable."""
    return math.prod(v.shape) if v.shape else 1


def stated(v: Any, name: str) -> Any:
    """Return an attribute of a variable, such as `min`, which its declared type may state instead; None if absent."""
    own = getattr(v, name, None)
    return getattr(v.declaredType, name, None) if own is None else own


def unit_of(v: Any) -> str:
    """Return the unit of measure of a variable; "" if there is none."""
    return stated(v, "unit") or ""


def _module(fmi: int) -> Any:
    return importlib.import_module(f"fmpy.fmi{fmi}")


TALLY: Counter[str] = Counter(dict.fromkeys(["instances", "values read", "values set", "steps", "derivatives"], 0))
"""Numbers of actions of all instances in this process so far, in the order of a report."""


class Instance:
    """One instance of an unpacked FMU. If a call fails, the method raises a `Finding` that names the variable.

    `description` is the model description read by fmpy. The function `log` is called with each log message; by default,
    messages are printed.

    Raises
    ------
    Finding
        The binary cannot be loaded, does not contain a function of the standard, or creates no instance.
    """

    def __init__(
        self,
        folder: Path,
        description: Any,
        interface: Interface,
        name: str = "check",
        log: Callable[[str], None] | None = None,
    ) -> None:
        TALLY["instances"] += 1
        self.version, self.interface = version(description), interface
        self._methods: dict[tuple[str, str], Callable[..., Any]] = {}
        kind = getattr(_module(self.version), f"FMU{self.version}{_KINDS[interface]}")
        identifier = interface_of(description, interface).modelIdentifier
        try:
            self.unit = kind(
                guid=description.guid, modelIdentifier=identifier, unzipDirectory=str(folder), instanceName=name
            )
        except AttributeError as e:  # fmpy searches every function of the standard in the binary
            raise Finding(f"the binary does not export {str(e).split()[-1]}") from None
        except Exception as e:
            words = str(e).replace(f"{folder.absolute()}/", "")  # a reader does not need the path of the copy
            raise Finding(f"the binary cannot be loaded: {words}") from None
        if self.version == 1:
            self._mend_status()
        try:
            self._instantiate(log)
        except Exception as e:
            raise Finding(f"the FMU cannot be instantiated: {e}") from None
        if not self.unit.component:
            raise Finding("the FMU cannot be instantiated: no instance is returned")

    def _mend_status(self) -> None:
        """Correct the return types of some calls of FMI 1.0, which fmpy 0.3 declares as text."""
        for name, function in self.unit._functions.items():
            if function.restype is C.c_char_p and name not in _TEXT:
                function.restype = C.c_int

    def _instantiate(self, log: Callable[[str], None] | None) -> None:
        if log is None:
            self.unit.instantiate()
            return

        def say(*words: Any) -> None:
            log(words[-1].decode(errors="replace"))

        if self.version == 3:
            self.unit.instantiate(logMessage=say)
            return
        fmi = _module(self.version)
        callbacks = getattr(fmi, f"fmi{self.version}CallbackFunctions")()
        callbacks.logger = getattr(fmi, f"fmi{self.version}CallbackLoggerTYPE")(say)
        callbacks.allocateMemory = fmi.defaultCallbacks.allocateMemory
        callbacks.freeMemory = fmi.defaultCallbacks.freeMemory
        self.unit.instantiate(**{"functions" if self.version == 1 else "callbacks": callbacks})

    def call(self, what: str, name: str, *args: Any, **more: Any) -> Any:
        """Return the result of the method `name` of the fmpy instance; `what` describes the call in a finding."""
        try:
            return getattr(self.unit, name)(*args, **more)
        except Finding:
            raise
        except Exception as e:
            raise Finding(f"{what}: {e}") from None

    def initialize(self, t: float) -> None:
        """Enter Initialization Mode at time t (s). FMI 1.0 has no such mode; its only call follows in `begin`."""
        self._t0 = t
        if self.version == 2:
            self.call("setting up the experiment", "setupExperiment", startTime=t)
            self.call("entering Initialization Mode", "enterInitializationMode")
        elif self.version == 3:
            self.call("entering Initialization Mode", "enterInitializationMode", startTime=t)
        elif self.interface == "ModelExchange":
            self.call(f"setting the time {t:g} s", "setTime", t)

    def begin(self) -> Any:
        """Leave Initialization Mode. For Model Exchange in FMI 1.0, return the result of the first event."""
        if self.version > 1:
            self.call("leaving Initialization Mode", "exitInitializationMode")
            return None
        at = [self._t0] if self.interface == "CoSimulation" else []
        told = self.call("initializing", "initialize", *at)
        return told if self.interface == "ModelExchange" else None

    def restart(self, t: float) -> None:
        """Reset the instance and initialise it at time t (s)."""
        self.call("reset", "reset")
        self.initialize(t)
        self.begin()

    def step(self, what: str, t: float, h: float) -> bool:
        """Make a communication step of length h (s) at t (s); return False if the FMU ends the simulation."""
        TALLY["steps"] += 1
        if self.version == 3:
            _, ended, early, _ = self.call(what, "doStep", t, h)
            if early and not ended:
                raise Finding(f"{what}: doStep returns early, which was not allowed")
            return not ended
        if self.version == 1:
            self.call(what, "doStep", t, h)
            return True
        try:
            self.unit.doStep(t, h)
        except Exception as e:
            if getattr(e, "status", None) == _DISCARD and self._terminated():
                return False
            raise Finding(f"{what}: {e}") from None
        return True

    def _terminated(self) -> bool:
        """Return whether an FMU of FMI 2.0 has discarded a step because it ends the simulation."""
        try:
            return bool(self.unit.getBooleanStatus(_TERMINATED))
        except Exception:
            return False

    def _method(self, verb: str, v: Any) -> Callable[..., Any]:
        """Return the method of the fmpy instance that gets or sets variables of the type of v."""
        key = verb, v.type
        if key not in self._methods:
            kind = ("Int64" if self.version == 3 else "Integer") if v.type == "Enumeration" else str(v.type)
            self._methods[key] = getattr(self.unit, f"{verb}{kind}")
        return self._methods[key]

    def get(self, v: Any, n: int | None = None) -> Values:
        """Return the values of all `n` elements of a variable; by default, n is the declared number."""
        references = [v.valueReference]
        TALLY["values read"] += 1
        try:
            get = self._method("get", v)
            size = count(v) if n is None else n
            values = get(references, size) if self.version == 3 else get(references)
            return tuple(map(float, map(bool, values) if v.type == "Boolean" else values))
        except Exception as e:
            raise Finding(f"{v.name} (value reference {v.valueReference}) cannot be read: {e}") from None

    def set(self, v: Any, values: Sequence[float]) -> None:
        """Set all elements of a variable. For integers, floats with whole values are accepted."""
        TALLY["values set"] += 1
        try:
            exact: Any = list(values) if v.type in REAL else [int(x) for x in values]
            self._method("set", v)([v.valueReference], [bool(x) for x in exact] if v.type == "Boolean" else exact)
        except Exception as e:
            what = f"{v.name} (value reference {v.valueReference}) cannot be set to {values[0]:g}"
            raise Finding(f"{what}: {e}") from None

    def derivative(self, unknown: Any, known: Any) -> float:
        """Return the directional derivative of `unknown` with respect to `known`, with seed 1."""
        TALLY["derivatives"] += 1
        what = f"the directional derivative of {unknown.name} with respect to {known.name} cannot be read"
        references = [unknown.valueReference], [known.valueReference], [1.0]
        return float(self.call(what, "getDirectionalDerivative", *references)[0])

    def free(self) -> None:
        """Free the instance and unload the binary."""
        self.unit.freeInstance()


_WORDS = {"true": 1.0, "false": 0.0}


def numbers(text: Any) -> tuple[float, ...]:
    """Return the numbers in the text of a start value; `true` and `false` are 1 and 0.

    An integer that a double cannot represent exactly is returned as int.
    """
    return tuple(_WORDS[w] if w in _WORDS else _number(w) for w in str(text).split())


def _number(word: str) -> float:
    x = float(word)
    try:
        return x if x == int(word) else int(word)
    except ValueError:
        return x


def carried(v: Any, x: float) -> float:
    """Return the number x converted to the type of a variable, as an int for integer types.

    Raises
    ------
    Finding
        The value is not finite or does not fit the integer type.
    """
    if v.type in REAL:
        return x
    if not isinstance(x, int) and not math.isfinite(x):
        raise Finding(f"{v.name}: a variable of type {v.type} cannot take {x}")
    if v.type == "Boolean":
        return float(x >= 0.5)
    low, high = _bounds(v.type)
    whole = round(x)
    if not low <= whole <= high:
        raise Finding(f"{v.name}: {x:g} does not fit the type {v.type}")
    return whole


def _bounds(kind: str) -> tuple[int, int]:
    bits = int("".join(c for c in kind if c.isdigit()) or 32)
    return (0, 2**bits - 1) if kind.startswith("U") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
