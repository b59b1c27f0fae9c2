"""A graph of blocks as data: nodes in the order of their evaluation, wires, inputs, outputs; written as a block file.

Endpoints are written as in Modelica, counting from 1: `"u"` is an input of the graph, `"net.u[2]"` the second element
of the variable `u` of the node `net`, `"net.u"` all of it.
"""

from __future__ import annotations

import binascii
import ctypes as C
import hashlib
import re
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hystfmu.core import IMPLICIT, Array, BlockType, Executor, Var, block_types
from hystfmu.errors import InputError

Value = float | int | bool | str | Sequence[float] | Array

MAGIC, VERSION = b"HYSTFMU\n", 2
_TOKEN = 40
_MOST_VALUES = 1 << 24  # as in graph_file.c
_LENGTH = re.compile(r"(\w+)(?: \+ (\d+))?\Z")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")
_ENDPOINT = re.compile(r"([A-Za-z][A-Za-z0-9_]*)(?:\.([A-Za-z][A-Za-z0-9_]*))?(?:\[(\d+)\])?\Z")


@dataclass(frozen=True)
class Node:
    """One block of a graph.

    Parameters
    ----------
    name : str
        Name of the instance, unique in the graph.
    type : str
        Key of the block, e.g. ``"prandtl_ishlinskii"``.
    dims : mapping of str to int
        Sizes; a missing one follows from the length of an array value, else from the table.
    values : mapping
        Parameter values; a missing one has the start value of the table.  Enumerations take their words.

    Raises
    ------
    InputError
        Unknown block, parameter or size, wrong length, value out of range.
    """

    name: str
    type: str
    dims: Mapping[str, int] = field(default_factory=dict)
    values: Mapping[str, Value] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not _NAME.match(self.name):
            raise InputError(f"the block name {self.name!r} must be a letter followed by letters, digits or _")
        kind = self.block  # raises on an unknown type
        unknown = set(self.dims) - {d.name for d in kind.dims}
        if unknown:
            raise InputError(f"{self.type} has no size {sorted(unknown)[0]!r}; it has {[d.name for d in kind.dims]}")
        unknown = set(self.values) - {v.name for v in kind.parameters}
        if unknown:
            names = [v.name for v in kind.parameters]
            raise InputError(f"{self.type} has no parameter {sorted(unknown)[0]!r}; it has {names}")
        object.__setattr__(self, "dims", self._complete_dims())
        sizes = self.sizes
        if sum(sizes.values()) > _MOST_VALUES:
            raise InputError(
                f"{self.name}: sizes {dict(self.dims)} make too many values; at most {_MOST_VALUES} fit a graph"
            )
        for v in kind.parameters:
            self._flat(v, sizes[v.name])

    @property
    def block(self) -> BlockType:
        """The description of the block."""
        types = block_types()
        if self.type not in types:
            raise InputError(f"no block {self.type!r}; 'hystfmu blocks' lists them: {', '.join(types)}")
        return types[self.type]

    def _complete_dims(self) -> dict[str, int]:
        dims = dict(self.dims)
        for v in self.block.parameters:  # a row of size n, or n + 1, tells n by its length
            m = _LENGTH.match(v.size)
            if m and v.name in self.values and m[1] not in dims and m[1] in {d.name for d in self.block.dims}:
                dims[m[1]] = int(np.size(np.asarray(self.values[v.name]))) - int(m[2] or 0)
        for d in self.block.dims:
            n = dims.setdefault(d.name, d.start)
            if isinstance(n, bool) or int(n) != n or not d.lo <= n <= d.hi:
                raise InputError(f"The size '{d.name}' of {self.name} must be an int in [{d.lo}, {d.hi}]. Got {n}.")
            dims[d.name] = int(n)
        return dims

    @property
    def sizes(self) -> dict[str, int]:
        """Number of elements of every variable."""
        return self.block.sizes(dict(self.dims))

    def _flat(self, v: Var, size: int) -> Array:
        value = self.values.get(v.name, v.start)
        if isinstance(value, str):
            if value not in v.choices:
                wanted = f"one of {list(v.choices)}" if v.choices else "a number"
                raise InputError(f"The '{v.name}' parameter of {self.name} must be {wanted}. Got {value!r} instead.")
            value = v.choices.index(value)
        try:
            array = np.asarray(value, dtype=np.float64).ravel()
        except (TypeError, ValueError):
            raise InputError(f"The '{v.name}' parameter of {self.name} must be numbers. Got {value!r}.") from None
        if array.size == 1 and size != 1:
            array = np.broadcast_to(array, (size,))
        if array.size != size:
            raise InputError(f"The '{v.name}' parameter of {self.name} must have {size} values. Got {array.size}.")
        bad = ~(np.isfinite(array) & (array >= v.lo) & (array <= v.hi))
        if v.type != "real":
            bad |= array != np.floor(array)
        if bad.any():
            got = array[bad][0]
            raise InputError(f"The '{v.name}' parameter of {self.name} must be {v.interval}. Got {got:.10g} instead.")
        return array

    def parameters(self) -> Array:
        """All parameter values in the order of the table, flat."""
        sizes = self.sizes
        return np.concatenate([self._flat(v, sizes[v.name]) for v in self.block.parameters] or [np.zeros(0)])

    def value(self, name: str) -> Array:
        """One parameter as a flat array."""
        rows = {v.name: v for v in self.block.parameters}
        if name not in rows:
            raise InputError(f"{self.type} has no parameter {name!r}; it has {list(rows)}")
        return self._flat(rows[name], self.sizes[name]).copy()

    def with_values(self, **values: Value) -> Node:
        """The same node with some values changed."""
        return Node(self.name, self.type, self.dims, {**self.values, **values})

    def feeds_through(self) -> bool:
        """Whether an output depends on the present inputs."""
        if not self.block.raw.feedthrough:
            return True
        sizes, kind = self.sizes, self.block
        derived = sum(sizes[v.name] for v in kind.of("derived"))
        p = np.concatenate([self.parameters(), np.zeros(derived)])
        dims = (C.c_int * (len(kind.dims) + 1))(*[self.dims[d.name] for d in kind.dims])
        return bool(kind.raw.feedthrough(dims, p.ctypes.data_as(C.POINTER(C.c_double))))


@dataclass(frozen=True)
class Input:
    """An input of a graph."""

    name: str
    to: tuple[str, ...]
    unit: str = ""
    start: float = 0.0
    text: str = ""


@dataclass(frozen=True)
class Output:
    """An output of a graph."""

    name: str
    source: str
    unit: str = ""
    text: str = ""


@dataclass(frozen=True)
class Port:
    """A variable of the finished unit, as an importer sees it: its elements have references from `reference` on."""

    name: str
    kind: str
    node: int
    var: Var
    place: int
    reference: int
    size: int
    unit: str
    text: str
    start: tuple[float, ...]

    @property
    def scalar_names(self) -> tuple[str, ...]:
        """One plain name per element: `w`, or `w_1`, `w_2`, ... for an array."""
        return (self.name,) if self.size == 1 else tuple(f"{self.name}_{i + 1}" for i in range(self.size))


@dataclass(frozen=True)
class ContinuousState:
    """One continuous state of the finished unit, as Model Exchange names it; its derivative is `der(name)`."""

    name: str
    unit: str
    text: str


class Graph:
    """Blocks, wires, inputs and outputs.

    Parameters
    ----------
    nodes : sequence of Node
        In the order of evaluation, unless `sort` is set.
    wires : sequence of (str, str)
        Pairs (source endpoint, destination endpoint) between nodes.
    inputs : sequence of Input
    outputs : sequence of Output
    sort : bool
        Put the nodes into an order in which every block with direct feed-through comes after its sources.  Without
        loops the chain is evaluated from input to output, without delay.  In a loop the blocks without direct
        feed-through come first and read the values held since the last step, as a sampled loop does.
    step : float
        Sample period (s) of the model, at which its sampled blocks advance in Model Exchange; 0: none is stated.

    Raises
    ------
    InputError
        A bad step, unknown endpoints, sizes that differ, an input wired twice, two nodes of one name, an algebraic loop
        (with the names along it).
    """

    def __init__(
        self,
        nodes: Sequence[Node],
        wires: Sequence[tuple[str, str]] = (),
        inputs: Sequence[Input] = (),
        outputs: Sequence[Output] = (),
        sort: bool = True,
        step: float = 0.0,
    ) -> None:
        if not (np.isfinite(step) and step >= 0):
            raise InputError(f"the step of a graph must be a float in [0, inf). Got {step} instead.")
        self.step = float(step)
        self.nodes = tuple(nodes)
        self.wires = tuple((a, b) for a, b in wires)
        self.inputs, self.outputs = tuple(inputs), tuple(outputs)
        names = [n.name for n in self.nodes]
        port_names = [i.name for i in self.inputs] + [o.name for o in self.outputs]
        for kind, listed in (("block", names), ("port", port_names)):
            twice = {n for n in listed if listed.count(n) > 1}
            if twice:
                raise InputError(f"two {kind}s have the name {sorted(twice)[0]!r}")
        self._resolve()
        order = self._order() if sort else list(range(len(self.nodes)))
        self.nodes = tuple(self.nodes[i] for i in order)
        self.links = self._resolve()
        self._order(check_only=True)
        self.ports = self._ports()

    def __getstate__(self) -> dict[str, object]:
        """What goes to another process: rows of the C tables are looked up again there."""
        return {k: v for k, v in self.__dict__.items() if k not in ("ports", "_links")}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self._links = self._resolve()
        self.ports = self._ports()

    @classmethod
    def single(cls, node: Node) -> Graph:
        """A graph of one block whose ports are the block's own."""
        kind = node.block
        inputs = [Input(v.name, (f"{node.name}.{v.name}",), v.unit, v.start, v.text) for v in kind.of("input")]
        outputs = [Output(v.name, f"{node.name}.{v.name}", v.unit, v.text) for v in kind.of("output")]
        return cls([node], (), inputs, outputs)

    def node(self, name: str) -> Node:
        """The node of that name."""
        for n in self.nodes:
            if n.name == name:
                return n
        raise InputError(f"no block {name!r} in the graph; it has {[n.name for n in self.nodes]}")

    def replace(self, node: Node) -> Graph:
        """The same graph with one node exchanged for another of the same name."""
        self.node(node.name)
        nodes = [node if n.name == node.name else n for n in self.nodes]
        return Graph(nodes, self.wires, self.inputs, self.outputs, sort=False, step=self.step)

    def with_step(self, step: float) -> Graph:
        """The same graph with another sample period (s)."""
        return Graph(self.nodes, self.wires, self.inputs, self.outputs, sort=False, step=step)

    # ---- resolving endpoints --------------------------------------------------------------------------------------
    def _endpoint(self, text: str, kinds: tuple[str, ...]) -> tuple[int, int, int, Var]:
        """(node, place among the variables of these kinds, number of elements, row)"""
        m = _ENDPOINT.match(text)
        index = {n.name: i for i, n in enumerate(self.nodes)}
        if not m or not m[2] or m[1] not in index:
            raise InputError(f"the connection end {text!r} names no block; blocks: {list(index)}")
        node = self.nodes[index[m[1]]]
        sizes, place = node.sizes, 0
        share = ("input", "time") if "input" in kinds else kinds
        for v in node.block.of(*share):
            if v.name == m[2] and v.kind in kinds:
                if m[3] is None:
                    return index[m[1]], place, sizes[v.name], v
                if not 1 <= int(m[3]) <= sizes[v.name]:
                    raise InputError(f"the index of {text!r} must be in 1..{sizes[v.name]}")
                return index[m[1]], place + int(m[3]) - 1, 1, v
            place += sizes[v.name]
        have = [v.name for v in node.block.of(*kinds)]
        raise InputError(f"the connection end {text!r}: {node.type} has no such {kinds[0]}; it has {have}")

    def _resolve(self) -> list[tuple[int, int, int, int, int]]:
        """Wires as (node, place, source or -1, place, size), sorted by node."""
        links: list[tuple[int, int, int, int, int]] = []
        for a, b in self.wires:
            to, to_place, n, _ = self._endpoint(b, ("input",))
            source, from_place, m, _ = self._endpoint(a, ("output",))
            if n != m:
                raise InputError(f"the connection {a!r} -> {b!r} joins {m} values to {n}")
            links.append((to, to_place, source, from_place, n))
        at = 0
        for port in self.inputs:
            if not port.to:
                raise InputError(f"the input {port.name!r} is connected to nothing")
            ends = [self._endpoint(b, ("input",)) for b in port.to]
            if len({e[2] for e in ends}) != 1:
                raise InputError(f"the input {port.name!r} is connected to inputs of different sizes")
            links += [(e[0], e[1], -1, at, e[2]) for e in ends]
            at += ends[0][2]
        self.n_inputs = at
        driven: set[tuple[int, int]] = set()
        for to, place, _, _, n in links:
            for k in range(place, place + n):
                if (to, k) in driven:
                    raise InputError(f"an input of {self.nodes[to].name!r} is connected twice")
                driven.add((to, k))
        return sorted(links)

    def _order(self, check_only: bool = False) -> list[int]:
        links = self._resolve()
        through = [n.feeds_through() for n in self.nodes]
        # the second input of an implicit inverse is what it tries its output for: no loop, and no source to wait for
        tried = [bool(n.block.flags & IMPLICIT) for n in self.nodes]
        all_edges = {(s, d) for d, place, s, _, _ in links if s >= 0 and not (tried[d] and place == 1)}
        for edges in (all_edges, {(s, d) for s, d in all_edges if through[d]}):
            order: list[int] = []
            left = list(range(len(self.nodes)))
            while left:
                free = [i for i in left if not any(s in left for s, d in edges if d == i)]
                if not free:
                    break
                # one at a time and the first in the listed order, so that an order that already fits stays as it is
                order.append(free[0])
                left.remove(free[0])
            if not left:
                if edges is not all_edges:
                    # in a loop, a block that only reads held values must not read a new one: it goes first
                    order.sort(key=lambda i: through[i])
                return order
        if left:
            path = [left[0]]
            while path.count(path[-1]) < 2:
                path.append(next(s for s, d in sorted(edges) if d == path[-1] and s in left))
            names = " <- ".join(self.nodes[i].name for i in path[path.index(path[-1]) :])
            raise InputError(f"algebraic loop: {names}; put a delay or a strictly proper transfer_function into it")
        return order

    # ---- what an importer sees ------------------------------------------------------------------------------------
    def _ports(self) -> tuple[Port, ...]:
        ports: list[Port] = []
        reference = 0

        def add(
            name: str, kind: str, node: int, v: Var, place: int, size: int, unit: str, text: str, start: Array
        ) -> None:
            nonlocal reference
            values = tuple(float(s) for s in start)
            ports.append(Port(name, kind, node, v, place, reference, size, unit or v.unit, text or v.text, values))
            reference += size

        at = 0
        for i in self.inputs:
            node, _, size, v = self._endpoint(i.to[0], ("input",))
            add(i.name, "input", node, v, at, size, i.unit, i.text, np.full(size, i.start))
            at += size
        for o in self.outputs:
            node, _, size, v = self._endpoint(o.source, ("output",))
            m = _ENDPOINT.match(o.source)
            place = int(m[3]) - 1 if m and m[3] else 0
            add(o.name, "output", node, v, place, size, o.unit, o.text, np.full(size, v.start))
        for k, n in enumerate(self.nodes):
            for v in n.block.parameters:
                start = n.value(v.name)
                name = v.name if len(self.nodes) == 1 else f"{n.name}_{v.name}"
                if start.size:
                    add(name, v.kind, k, v, 0, start.size, "", "", start)
        names = [s for p in ports for s in p.scalar_names]
        if len(set(names)) < len(names):
            twice = next(n for n in names if names.count(n) > 1)
            raise InputError(f"two variables of the unit would have the name {twice!r}; rename a block or a port")
        return tuple(ports)

    def port(self, name: str) -> Port:
        """The variable of that name."""
        for p in self.ports:
            if p.name == name:
                return p
        raise InputError(f"no variable {name!r}; there are {', '.join(p.name for p in self.ports[:20])}")

    @property
    def continuous_states(self) -> tuple[ContinuousState, ...]:
        """The continuous states in the order of the core, one per element; none is a variable that can be set."""
        taken = {s for p in self.ports for s in p.scalar_names}
        states: list[ContinuousState] = []
        for n in self.nodes:
            for v in n.block.of("cstate"):
                size = n.sizes[v.name]
                name = v.name if len(self.nodes) == 1 else f"{n.name}_{v.name}"
                for i in range(size):
                    own = name if size == 1 else f"{name}_{i + 1}"
                    while own in taken:  # names are free text: a port may have taken it
                        own += "_"
                    taken.add(own)
                    states.append(ContinuousState(own, v.unit, v.text))
        return tuple(states)

    @property
    def n_outputs(self) -> int:
        """Number of scalar outputs."""
        return sum(p.size for p in self.ports if p.kind == "output")

    def dependencies(self) -> dict[str, tuple[str, ...]]:
        """For every output port the names of the input ports that it depends on through direct feed-through."""
        through = [n.feeds_through() for n in self.nodes]
        starts, at = [], 0
        for i in self.inputs:
            starts.append(at)
            at += self._endpoint(i.to[0], ("input",))[2]
        reach: dict[int, set[str]] = {k: set() for k in range(len(self.nodes))}
        changed = True
        while changed:
            changed = False
            for d, _, s, place, _ in self.links:
                if not through[d]:
                    continue
                names = reach[s] if s >= 0 else {self.inputs[max(j for j, b in enumerate(starts) if b <= place)].name}
                if not names <= reach[d]:
                    reach[d] |= names
                    changed = True
        listed = [i.name for i in self.inputs]
        return {
            o.name: tuple(sorted(reach[self._endpoint(o.source, ("output",))[0]], key=listed.index))
            for o in self.outputs
        }

    # ---- the block file --------------------------------------------------------------------------------------------
    def to_bytes(self) -> bytes:
        """The block file (`resources/block.bin`); the format is in `fmu_build/README.md`."""
        kinds = {"param": 0, "fixed": 1, "input": 3, "output": 5}

        def name(s: str) -> bytes:
            b = s.encode("ascii")
            return struct.pack("<I", len(b)) + b

        out = [struct.pack("<dI", self.step, len(self.nodes))]
        for n in self.nodes:
            p = n.parameters()
            dims = [n.dims[d.name] for d in n.block.dims]
            out += [name(n.name), name(n.type), struct.pack(f"<I{len(dims)}I", len(dims), *dims)]
            out += [struct.pack("<I", p.size), p.astype("<f8").tobytes()]
        starts = [s for p in self.ports if p.kind == "input" for s in p.start]
        out.append(struct.pack(f"<I{len(starts)}d", len(starts), *starts))
        out.append(struct.pack("<I", len(self.links)))
        out += [struct.pack("<5i", *link) for link in self.links]
        out.append(struct.pack("<I", len(self.ports)))
        for port in self.ports:
            var = self.nodes[port.node].block.vars.index(port.var)
            out += [
                name(port.name),
                struct.pack("<5I", kinds[port.kind], port.node, var, port.place, port.size),
            ]
        body = b"".join(out)
        digest = hashlib.sha256(body).hexdigest()
        token = f"{digest[:8]}-{digest[8:12]}-{digest[12:16]}-{digest[16:20]}-{digest[20:32]}".encode()
        checked = token.ljust(_TOKEN, b"\0") + body
        length = len(MAGIC) + 12 + len(checked)
        return MAGIC + struct.pack("<III", VERSION, length, binascii.crc32(checked)) + checked

    @property
    def token(self) -> str:
        """The token that ties the block file to its modelDescription.xml (guid, instantiationToken)."""
        return self.to_bytes()[len(MAGIC) + 12 :][:_TOKEN].rstrip(b"\0").decode()

    def executor(self) -> Executor:
        """The graph loaded into the C core."""
        return Executor(self.to_bytes())

    def run(self, u: Array | Sequence[float], h: float = 1.0, t0: float = 0.0) -> Array:
        """Outputs for input rows `u`, `h` seconds apart, from a fresh start.

        Parameters
        ----------
        u : array, shape (n,) or (n, number of inputs)
            Inputs, held over the step that ends at their row; row 0 is the initialisation.
        h : float
            Step in seconds.

        Returns
        -------
        array, shape (n,) for one output, else (n, number of outputs)
        """
        rows = np.asarray(u, dtype=np.float64)
        if rows.ndim == 1:
            rows = rows[:, None]
        if rows.shape[1] != self.n_inputs:
            raise InputError(f"the graph has {self.n_inputs} inputs; got rows of {rows.shape[1]}")
        if not np.isfinite(rows).all():
            raise InputError(f"the input is not finite in row {int(np.argwhere(~np.isfinite(rows))[0][0])}")
        y = self.executor().run(rows, self.n_outputs, h, t0)
        return y[:, 0] if y.shape[1] == 1 else y
