"""Shared parts of the FMU tests: graphs, unpacked FMUs, and a master that returns every status (ctypes)."""

import copy
import ctypes as C
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from fmpy import platform, platform_tuple, sharedLibraryExtension
from numpy.typing import NDArray

from hystfmu.core.library import block_types
from hystfmu.fmu import export_fmu
from hystfmu.graph import Graph, Input, Node, Output

Array = NDArray[np.float64]
Make = Callable[..., Any]  # the fixture `make`
only_fmi2, only_fmi3 = (pytest.mark.parametrize("fmi", [n], indirect=True) for n in (2, 3))
OK, WARNING, DISCARD, ERROR = range(4)
H = 1e-3
BLOCKS = sorted(block_types())

# values for blocks whose defaults give a constant output
_R, _W = np.linspace(0.0, 0.9, 10), np.linspace(1.0, 0.1, 10)
_LIVE: dict[str, dict[str, Any]] = {
    "prandtl_ishlinskii": {"w0": 0.3, "r": _R, "w": _W},
    "prandtl_ishlinskii_inverse": {"w0": 0.3, "r": _R, "w": _W},
    "mlp": {"W1": np.sin(np.arange(24.0)), "b1": np.cos(np.arange(12.0)), "W2": np.sin(np.arange(12.0))},
    "disturbance": {"step": 1.0, "t_step": 0.05, "amplitude": 0.3, "frequency": 20.0},
    "dead_zones": {"w0": 1.0},
    "noise": {"sigma": 0.5},
    "pid": {"Kp": 1.0},
    "lead_lag": {"K": 1.0},
    "sliding_mode": {"eta": 1e-3, "rho": 0.01},
    "super_twisting": {"k_1": 0.01, "k_2": 0.1},
    "iterative_learning": {"gain": 0.5},
    "repetitive": {"q": [0.3, 0.3], "l": [0.1, 0.1, 0.1]},
}
_DIMS = {"mlp": {"n_in": 2}, "scaling": {"n": 3}}


def single(name: str) -> Graph:
    """Return a graph of one block, with values for which its output varies."""
    return Graph.single(Node(name, name, _DIMS.get(name, {}), _LIVE.get(name, {}))).with_step(H)


def loop() -> Graph:
    """Return a closed loop: reference, PID, hysteresis, second-order dynamics; the disturbance is an input."""
    nodes = [
        Node("ref", "reference", {}, {"amplitude": 0.8, "frequency": 7.0}),
        Node("ctl", "pid", {}, {"Kp": 0.4, "Ki": 60.0}),
        Node("add", "sum", {"n": 2}),
        Node("plant", "prandtl_ishlinskii", {}, _LIVE["prandtl_ishlinskii"]),
        Node("dyn", "transfer_function", {"nb": 0, "na": 2}, {"b": [1.0], "a": [1e-5, 1e-2, 1.0]}),
    ]
    wires = [
        ("ref.r", "ctl.y_d"), ("dyn.y", "ctl.y"), ("ctl.u", "add.u[1]"), ("add.y", "plant.u"), ("plant.y", "dyn.u"),
    ]  # fmt: skip
    outputs = [Output("y", "dyn.y", "um"), Output("u", "ctl.u", "V"), Output("r", "ref.r", "um")]
    return Graph(nodes, wires, [Input("d", ("add.u[2]",), "V")], outputs, step=H)


def mixed() -> Graph:
    """Return a graph of all rate classes: hysteresis, continuous dynamics, sampled derivative, function."""
    nodes = [
        Node("op", "prandtl_ishlinskii", {}, _LIVE["prandtl_ishlinskii"]),
        Node("dyn", "transfer_function", {"nb": 1, "na": 2}, {"b": [2e-3, 1.0], "a": [1e-5, 4e-3, 1.0]}),
        Node("rate", "differentiator"),
        Node("add", "sum", {"n": 2}, {"k": [1.0, 1e-3]}),
    ]
    wires = [("op.y", "dyn.u"), ("dyn.y", "rate.u"), ("dyn.y", "add.u[1]"), ("rate.du", "add.u[2]")]
    outputs = [Output("y", "add.y"), Output("x", "dyn.y"), Output("du", "rate.du"), Output("h", "op.y")]
    return Graph(nodes, wires, [Input("u", ("op.u",))], outputs, step=H)


def rows(graph: Graph, n: int = 300, seed: int = 3) -> Array:
    """Return inputs with nested reversals within the declared ranges, one column per scalar input."""
    rng = np.random.default_rng(seed)
    inputs = [p for p in graph.ports if p.kind == "input" for _ in range(p.size)]
    columns = []
    for p in inputs:
        levels = rng.uniform(-1.5, 1.5, n // 10 + 2)
        columns.append(np.clip(np.interp(np.arange(n) / 10, np.arange(levels.size), levels), p.var.lo, p.var.hi))
    return np.column_stack([*columns, np.zeros((n, 0))])


U = rows(single("prandtl_ishlinskii"))[:, 0]


def unpack(fmu: Path, folder: Path) -> Path:
    """Unpack an FMU into a folder."""
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    return folder


class Master:
    """One FMU instance called by ctypes; `messages` holds its log as (status, category, text).

    `interface` is "cs", "me", or, in FMI 3.0, "event": Co-Simulation with Event Mode.
    """

    def __init__(
        self,
        graph: Graph,
        folder: Path,
        fmi: int,
        token: str | None = None,
        location: str | None = None,
        interface: str = "cs",
    ) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.fmi, self.graph, self.prefix, self.interface = fmi, graph, f"fmi{fmi}", interface
        target = folder / f"unpacked{fmi}"
        if not target.exists():
            unpack(export_fmu(graph, folder / f"m{fmi}.fmu", fmi, "m"), target)  # type: ignore[arg-type]
        self.lib = C.CDLL(
            str(target / "binaries" / (platform if fmi == 2 else platform_tuple) / f"m{sharedLibraryExtension}")
        )
        self.resources = target / "resources"
        self.messages: list[tuple[int, str, str]] = []
        self.names: list[bytes] = []
        self.token, self.ports = token or graph.token, {p.name: p for p in graph.ports}
        if location is None:
            location = self.resources.as_uri() if fmi == 2 else f"{self.resources}/"
        self.c = self.instantiate(location.encode())

    def instantiate(
        self,
        location: bytes | None,
        name: bytes | None = b"i",
        token: bytes | None = b"",
        logging: bool = False,
        references: list[int] | None = None,
        update: Any = None,
    ) -> C.c_void_p:
        """Make an instance, with intermediate updates of the variables `references` in Co-Simulation of FMI 3.0."""
        token = self.token.encode() if token == b"" else token

        def log3(_: Any, status: int, category: bytes, text: bytes) -> None:
            self.messages.append((status, category.decode(), text.decode()))

        def log2(_: Any, name: bytes, *said: Any) -> None:
            self.names.append(name)
            log3(_, *said)

        if self.fmi == 2:
            kind = C.CFUNCTYPE(None, C.c_void_p, C.c_char_p, C.c_int, C.c_char_p, C.c_char_p)
            self._log: Any = kind(log2)
            pointer = C.cast(self._log, C.c_void_p)
            self._functions = (C.c_void_p * 5)(pointer, None, None, None, None)
            make = self.lib.fmi2Instantiate
            make.restype = C.c_void_p
            kind2 = 0 if self.interface == "me" else 1
            return C.c_void_p(make(name, kind2, token, location, C.byref(self._functions), 0, int(logging)))
        self._log = C.CFUNCTYPE(None, C.c_void_p, C.c_int, C.c_char_p, C.c_char_p)(log3)
        if self.interface == "me":
            make = self.lib.fmi3InstantiateModelExchange
            make.restype = C.c_void_p
            return C.c_void_p(make(name, token, location, 0, int(logging), None, self._log))
        make = self.lib.fmi3InstantiateCoSimulation
        make.restype = C.c_void_p
        n, flags = len(references or ()), (0, int(logging), int(self.interface == "event"), 0)
        listed = None if references is None else (C.c_uint * n)(*references)
        return C.c_void_p(make(name, token, location, *flags, listed, C.c_size_t(n), None, self._log, update))

    def another(self, **given: Any) -> "Master":
        """Make another instance of the same binary, as `instantiate` does, with messages of its own."""
        made = copy.copy(self)
        made.messages, made.names = [], []
        where = self.resources.as_uri() if self.fmi == 2 else f"{self.resources}/"
        made.c = made.instantiate(where.encode(), **given)
        return made

    def call(self, name: str, *arguments: Any) -> int:
        """Call fmi2<name> or fmi3<name> of the instance and return the status."""
        return int(getattr(self.lib, self.prefix + name)(self.c, *arguments))

    # ---- values ---------------------------------------------------------------------------------------------------
    _TYPES: ClassVar = {
        "real": ("Real", C.c_double, "Float64", C.c_double),
        "int": ("Integer", C.c_int, "Int32", C.c_int32),
        "bool": ("Boolean", C.c_int, "Boolean", C.c_bool),
        "enum": ("Integer", C.c_int, "Int64", C.c_int64),
    }

    def _access(self, what: str, name: str, values: list[float] | None) -> tuple[int, list[float]]:
        p = self.ports[name]
        row = self._TYPES["enum" if p.var.choices else p.var.type]
        suffix, ctype = row[:2] if self.fmi == 2 else row[2:]
        buffer = (ctype * p.size)(*([ctype(0).value] * p.size if values is None else map(type(ctype(0).value), values)))
        if self.fmi == 2:
            refs = (C.c_uint * p.size)(*range(p.reference, p.reference + p.size))
            status = self.call(what + suffix, refs, C.c_size_t(p.size), buffer)
        else:
            refs = (C.c_uint * 1)(p.reference)
            status = self.call(what + suffix, refs, C.c_size_t(1), buffer, C.c_size_t(p.size))
        return status, [float(x) for x in buffer]

    def set(self, name: str, *values: float) -> int:
        """Set all elements of a variable and return the status."""
        return self._access("Set", name, list(values))[0]

    def get(self, name: str) -> Any:
        """Read a variable: a float, or a list for an array."""
        status, values = self._access("Get", name, None)
        assert status == OK, self.messages[-1:]
        return values[0] if len(values) == 1 else values

    def tangent(self, unknowns: list[int], knowns: list[int], seed: Array, n: int, name: str = "Directional") -> Any:
        """Return status and n numbers: (d unknowns / d knowns) seed, or the transposed product of the adjoint."""
        lists = [((C.c_uint * len(r))(*r), C.c_size_t(len(r))) for r in (unknowns, knowns)]
        given, got = (C.c_double * len(seed))(*seed), (C.c_double * n)()
        sizes = [()] * 2 if self.fmi == 2 else [(C.c_size_t(len(seed)),), (C.c_size_t(n),)]
        status = self.call(f"Get{name}Derivative", *lists[0], *lists[1], given, *sizes[0], got, *sizes[1])
        return status, np.array(got)

    # ---- life -----------------------------------------------------------------------------------------------------
    def enter(self, t: float = 0.0, stop: float | None = None) -> int:
        """Enter Initialization Mode and return the status."""
        times = (C.c_double(0), C.c_double(t), C.c_int(stop is not None), C.c_double(stop or 0))
        if self.fmi == 3:
            return self.call("EnterInitializationMode", C.c_int(0), *times)
        return self.call("SetupExperiment", C.c_int(0), *times) or self.call("EnterInitializationMode")

    def initialize(self, t: float = 0.0, stop: float | None = None) -> None:
        """Initialise; the instance is then in Step Mode, or in Event Mode of the other interfaces."""
        assert self.enter(t, stop) == OK
        assert self.call("ExitInitializationMode") == OK

    def step(self, t: float, h: float = H) -> int:
        """Make a step and return the status."""
        if self.fmi == 2:
            return self.call("DoStep", C.c_double(t), C.c_double(h), C.c_int(1))
        flags = [C.byref(C.c_bool()) for _ in range(3)]
        self.last_time = C.c_double()
        return self.call("DoStep", C.c_double(t), C.c_double(h), C.c_bool(True), *flags, C.byref(self.last_time))

    def run(self, u: Array, first: int = 0) -> list[float]:
        """Step with the rows of the single input `u` and return the output `y` after each step."""
        y = []
        for k, value in enumerate(u, first):
            assert self.set("u", float(value)) == OK
            assert self.step(k * H) == OK
            y.append(self.get("y"))
        return y

    # ---- saved states ---------------------------------------------------------------------------------------------
    def _state(self, name: str) -> str:
        return name.replace("State", "state").replace("Deserialize", "DeSerialize") if self.fmi == 2 else name

    def save(self) -> C.c_void_p:
        """Save the state."""
        state = C.c_void_p()
        assert self.call(self._state("GetFMUState"), C.byref(state)) == OK
        return state

    def restore(self, state: C.c_void_p) -> int:
        """Restore a state and return the status."""
        return self.call(self._state("SetFMUState"), state)

    def forget(self, state: C.c_void_p) -> int:
        """Status of freeing a copy of the pointer."""
        return self.call(self._state("FreeFMUState"), C.byref(C.c_void_p(state.value)))

    def serialize(self, state: C.c_void_p) -> bytes:
        """The bytes of a saved state."""
        size = C.c_size_t()
        assert self.call(self._state("SerializedFMUStateSize"), state, C.byref(size)) == OK
        buffer = C.create_string_buffer(size.value)
        assert self.call(self._state("SerializeFMUState"), state, buffer, size) == OK
        return buffer.raw

    def deserialize(self, content: bytes) -> tuple[int, C.c_void_p]:
        """Deserialize a state; return the status and the state."""
        state = C.c_void_p()
        status = self.call(self._state("DeserializeFMUState"), content, C.c_size_t(len(content)), C.byref(state))
        return status, state

    def memory(self) -> bytes:
        """Return the whole state as bytes, to show that a call changed nothing."""
        state = self.save()
        content = self.serialize(state)
        assert self.forget(state) == OK
        return content

    def free(self) -> None:
        """Free the instance."""
        getattr(self.lib, self.prefix + "FreeInstance")(self.c)
