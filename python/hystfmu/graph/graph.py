"""Graphs of blocks: their definition, their serialisation as block files, and their time steps.

The ends of a wire are written as in Modelica, with indices from 1. `"u"` is an input of the graph. `"net.u[2]"` is the
second element of the variable `u` of the node `net`. `"net.u"` is the whole variable. The block file
(`resources/block.bin`) contains the serialised graph for the C core; `fmu_build/README.md` describes the format.
"""

from __future__ import annotations

import binascii
import hashlib
import math
import re
import struct
from collections.abc import Sequence

import numpy as np

from hystfmu.base import Array, InputError, checked
from hystfmu.core.executor import ContinuousExecutor, Executor
from hystfmu.core.library import Var
from hystfmu.graph.dependencies import dependencies, evaluation_order
from hystfmu.graph.node import ContinuousState, Input, Node, Output, Port, Value, element_names

MAGIC, VERSION = b"HYSTFMU\n", 2
_TOKEN = 40
_MOST_NAME = 255  # maximum length of a name in a block file


def block_file(
    step: float, nodes: Sequence[Node], links: Sequence[tuple[int, int, int, int, int]], ports: Sequence[Port]
) -> bytes:
    """Return the block file of a graph.

    `step` is the sample period (s), or 0. The blocks are in the order of evaluation, the wires are sorted by node, and
    the ports are in the order of their value references.
    """
    kinds = {"param": 0, "fixed": 1, "input": 3, "output": 5}

    def name(s: str) -> bytes:
        b = s.encode("ascii")
        return struct.pack("<I", len(b)) + b

    out = [struct.pack("<dI", step, len(nodes))]
    for n in nodes:
        p = n.parameters()
        dims = [n.dims[d.name] for d in n.block.dims]
        out += [name(n.name), name(n.type), struct.pack(f"<I{len(dims)}I", len(dims), *dims)]
        out += [struct.pack("<I", p.size), p.astype("<f8").tobytes()]
    starts = [s for p in ports if p.kind == "input" for s in p.start]
    out.append(struct.pack(f"<I{len(starts)}d", len(starts), *starts))
    out.append(struct.pack("<I", len(links)))
    out += [struct.pack("<5i", *link) for link in links]
    out.append(struct.pack("<I", len(ports)))
    for port in ports:
        var = nodes[port.node].block.vars.index(port.var)
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


def token_of(file: bytes) -> str:
    """Return the token of a block file. The token is a hash of the bytes that follow it in the file."""
    return file[len(MAGIC) + 12 :][:_TOKEN].rstrip(b"\0").decode()


__all__ = ["ContinuousState", "Graph", "Input", "Node", "Output", "Port", "Value"]

MOST_SHOWN = 6  # maximum number of blocks that a repr lists
_ENDPOINT = re.compile(r"([A-Za-z][A-Za-z0-9_]*)(?:\.([A-Za-z][A-Za-z0-9_]*))?(?:\[(\d+)\])?\Z")


@checked
class Graph:
    """A graph of blocks that are connected by wires. Every model is such a graph.

    Parameters
    ----------
    nodes : sequence of Node
        Blocks. If `sort` is False, they must be in the order of evaluation.
    wires : sequence of (str, str)
        Connections between blocks, each as a pair of an output of a block and an input of a block.
    inputs : sequence of Input
        Inputs of the graph.
    outputs : sequence of Output
        Outputs of the graph.
    sort : bool
        Whether to sort the blocks so that every block with direct feed-through follows its sources. Then a chain
        without loops is evaluated from input to output without delay. In a loop, blocks without direct feed-through
        come first; they use the values of the last step, as in a sampled loop.
    step : float
        Sample period (s) of the sampled blocks in Model Exchange; 0 if the graph states no period.

    Raises
    ------
    InputError
        The step is invalid, the end of a wire is unknown, the sizes of its ends differ, an input has two sources, two
        blocks have the same name, or the graph has an algebraic loop. The message names the blocks of the loop.

    Examples
    --------
    >>> import hystfmu as hy
    >>> plays = hy.Node("plays", "backlash_sum", values={"w0": 0.4, "r": [0.1, 0.3], "w": [0.5, 0.2]})
    >>> gain = hy.Node("gain", "sum", {"n": 1}, {"k": [2.0]})
    >>> ends = [hy.Input("u", ("plays.u",))], [hy.Output("y", "gain.y")]
    >>> graph = hy.Graph([plays, gain], [("plays.y", "gain.u")], *ends)
    >>> graph
    Graph(u -> y; plays, gain)
    >>> [round(float(y), 12) for y in graph.run([0.0, 1.0, 0.5])]
    [0.0, 1.98, 1.28]
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
            raise InputError(f"The step of a graph must be a float in [0, inf). Got {step} instead.")
        self.step = float(step)
        self.nodes = tuple(nodes)
        self.wires = tuple((a, b) for a, b in wires)
        self.inputs, self.outputs = tuple(inputs), tuple(outputs)
        names = [n.name for n in self.nodes]
        port_names = [i.name for i in self.inputs] + [o.name for o in self.outputs]
        for kind, listed in (("block", names), ("port", port_names)):
            twice = {n for n in listed if listed.count(n) > 1}
            if twice:
                raise InputError(f"The {kind}s of a graph must have different names. Got {sorted(twice)[0]!r} twice.")
        self.links = self._resolve()
        order = evaluation_order(self.nodes, self.links)  # raises InputError for an algebraic loop
        if sort:
            self.nodes = tuple(self.nodes[i] for i in order)
            self.links = self._resolve()
        self.ports = self._ports()

    def __repr__(self) -> str:
        sides = (", ".join(p.name for p in ports) for ports in (self.inputs, self.outputs))
        shown = [n.name for n in self.nodes[:MOST_SHOWN]] + (["..."] if len(self.nodes) > MOST_SHOWN else [])
        return f"Graph({' -> '.join(sides)}; {', '.join(shown)})"

    def __getstate__(self) -> dict[str, object]:
        """Return the state for pickle without the ports, because the ports contain pointers to the C tables."""
        return {k: v for k, v in self.__dict__.items() if k != "ports"}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self.ports = self._ports()

    @classmethod
    def single(cls, node: Node) -> Graph:
        """Return a graph of the single block `node`, with the inputs and outputs of this block."""
        kind = node.block
        inputs = [Input(v.name, (f"{node.name}.{v.name}",), v.unit, v.start, v.text) for v in kind.of("input")]
        outputs = [Output(v.name, f"{node.name}.{v.name}", v.unit, v.text) for v in kind.of("output")]
        return cls([node], (), inputs, outputs)

    def node(self, name: str) -> Node:
        """Return the node with the name `name`.

        Raises
        ------
        InputError
            The graph has no node with this name.
        """
        for n in self.nodes:
            if n.name == name:
                return n
        raise InputError(f"The block must be one of {[n.name for n in self.nodes]}. Got {name!r} instead.")

    def replace(self, node: Node) -> Graph:
        """Return a graph in which `node` replaces the node of the same name."""
        self.node(node.name)
        nodes = [node if n.name == node.name else n for n in self.nodes]
        return Graph(nodes, self.wires, self.inputs, self.outputs, sort=False, step=self.step)

    def unused(self, name: str) -> str:
        """Return `name`, with underscores appended if a block already has this name."""
        taken = {n.name for n in self.nodes}
        while name in taken:
            name += "_"
        return name

    def with_step(self, step: float) -> Graph:
        """Return the same graph with the sample period `step` (s)."""
        return Graph(self.nodes, self.wires, self.inputs, self.outputs, sort=False, step=step)

    # ---- ends of wires --------------------------------------------------------------------------------------------
    def _endpoint(self, text: str, kinds: tuple[str, ...]) -> tuple[int, int, int, Var]:
        """Return what an end of a wire connects: index of the node, first element, number of elements, variable.

        The first element is an index over the elements of all variables of the given kinds.
        """
        m = _ENDPOINT.match(text)
        index = {n.name: i for i, n in enumerate(self.nodes)}
        if not m or not m[2] or m[1] not in index:
            raise InputError(f"The block of a connection end must be one of {list(index)}. Got {text!r} instead.")
        node = self.nodes[index[m[1]]]
        sizes, place = node.sizes, 0
        share = ("input", "time") if "input" in kinds else kinds
        for v in node.block.of(*share):
            if v.name == m[2] and v.kind in kinds:
                if m[3] is None:
                    return index[m[1]], place, sizes[v.name], v
                if not 1 <= int(m[3]) <= sizes[v.name]:
                    raise InputError(f"The index of {text!r} must be in 1..{sizes[v.name]}. Got {m[3]} instead.")
                return index[m[1]], place + int(m[3]) - 1, 1, v
            place += sizes[v.name]
        have = [v.name for v in node.block.of(*kinds)]
        raise InputError(
            f"The {kinds[0]} of {node.type} at a connection end must be one of {have}. Got {text!r} instead."
        )

    def _resolve(self) -> list[tuple[int, int, int, int, int]]:
        """Return the wires as tuples of indices, sorted by the node to which they lead.

        A tuple contains the node, the first connected element of its inputs, the source node (-1 for an input of the
        graph), the first connected element of its outputs, and the number of elements.
        """
        links: list[tuple[int, int, int, int, int]] = []
        for a, b in self.wires:
            to, to_place, n, _ = self._endpoint(b, ("input",))
            source, from_place, m, _ = self._endpoint(a, ("output",))
            if n != m:
                raise InputError(f"The connection {a!r} -> {b!r} must join equal sizes. Got {m} and {n} instead.")
            links.append((to, to_place, source, from_place, n))
        at = 0
        for port in self.inputs:
            if not port.to:
                raise InputError(f"The input {port.name!r} must be connected to a block. Got no connection.")
            ends = [self._endpoint(b, ("input",)) for b in port.to]
            if len({e[2] for e in ends}) != 1:
                sizes = [e[2] for e in ends]
                raise InputError(f"The input {port.name!r} must be connected to inputs of one size. Got sizes {sizes}.")
            links += [(e[0], e[1], -1, at, e[2]) for e in ends]
            at += ends[0][2]
        self.n_inputs = at
        driven: set[tuple[int, int]] = set()
        for to, place, _, _, n in links:
            for k in range(place, place + n):
                if (to, k) in driven:
                    raise InputError(f"An input of {self.nodes[to].name!r} must have one source. Got two connections.")
                driven.add((to, k))
        return sorted(links)

    # ---- ports: variables that an importer can access -------------------------------------------------------------
    def _ports(self) -> tuple[Port, ...]:
        ports: list[Port] = []
        reference = 0

        def add(name: str, kind: str, node: int, v: Var, place: int, start: Array, unit: str, text: str = "") -> None:
            nonlocal reference
            values = tuple(float(s) for s in start)
            at = reference, len(values)
            ports.append(Port(name, kind, node, v, place, *at, unit or v.unit, text or v.text, values))
            reference += len(values)

        at = 0
        for i in self.inputs:
            node, _, size, v = self._endpoint(i.to[0], ("input",))
            add(i.name, "input", node, v, at, np.full(size, i.starts or i.start), i.unit, i.text)
            at += size
        for o in self.outputs:
            node, _, size, v = self._endpoint(o.source, ("output",))
            m = _ENDPOINT.match(o.source)
            place = int(m[3]) - 1 if m and m[3] else 0
            add(o.name, "output", node, v, place, np.full(size, v.start), o.unit, o.text)
        driven = {end.partition("[")[0]: i.unit for i in self.inputs for end in i.to}
        for k, n in enumerate(self.nodes):
            for v in n.block.parameters:
                start = n.value(v.name)
                name = v.name if len(self.nodes) == 1 else f"{n.name}_{v.name}"
                if start.size:
                    add(name, v.kind, k, v, 0, start, driven.get(f"{n.name}.{v.follows}", ""))
        names = [s for p in ports for s in p.scalar_names]
        if len(set(names)) < len(names):
            twice = next(n for n in names if names.count(n) > 1)
            raise InputError(
                f"The variables of a unit must have different names. Got {twice!r} twice: rename a block or a port."
            )
        for name in (*(n.name for n in self.nodes), *(p.name for p in ports)):
            if not (0 < len(name) <= _MOST_NAME and name.isascii() and name.isprintable()):
                raise InputError(
                    f"The name of a block or a port must have 1 to {_MOST_NAME} printable ASCII characters. "
                    f"Got {name[:_MOST_NAME]!r} instead."
                )
        return tuple(ports)

    def port(self, name: str) -> Port:
        """Return the port with the name `name`.

        Raises
        ------
        InputError
            The graph has no port with this name.
        """
        for p in self.ports:
            if p.name == name:
                return p
        raise InputError(f"The variable must be one of {[p.name for p in self.ports[:20]]}. Got {name!r} instead.")

    @property
    def continuous_states(self) -> tuple[ContinuousState, ...]:
        """Continuous states in the order of the C core, one for each element. An importer cannot set them."""
        taken = {s for p in self.ports for s in p.scalar_names}
        states: list[ContinuousState] = []
        for n in self.nodes:
            for v in n.block.of("cstate"):
                name = v.name if len(self.nodes) == 1 else f"{n.name}_{v.name}"
                for own in element_names(name, n.sizes[v.name]):
                    while own in taken:  # the user chooses the names of ports, so a name may already exist
                        own += "_"
                    taken.add(own)
                    states.append(ContinuousState(own, v.unit, v.text))
        return tuple(states)

    @property
    def n_outputs(self) -> int:
        """Number of scalar outputs."""
        return sum(p.size for p in self.ports if p.kind == "output")

    def dependencies(self) -> dict[str, tuple[str, ...]]:
        """Return, for every output port, the input ports that it depends on through direct feed-through."""
        listed = [i.name for i in self.inputs]
        outputs, _ = dependencies(self.nodes, self.links, self.ports)
        return {name: tuple(sorted(known.inputs, key=listed.index)) for name, known in outputs.items()}

    # ---- running --------------------------------------------------------------------------------------------------
    def to_bytes(self) -> bytes:
        """Return the block file of the graph (`resources/block.bin`); `fmu_build/README.md` describes the format."""
        return block_file(self.step, self.nodes, self.links, self.ports)

    @property
    def token(self) -> str:
        """Token of the block file, which must equal `guid` or `instantiationToken` of modelDescription.xml."""
        return token_of(self.to_bytes())

    def executor(self) -> Executor:
        """Return a new executor of the graph in the C core."""
        return Executor(self.to_bytes())

    def run(self, u: Array | Sequence[float], h: float = 1.0, t0: float = 0.0) -> Array:
        """Compute the outputs for all input rows, from the initial state.

        Parameters
        ----------
        u : array, shape (n,) or (n, n_inputs)
            Inputs. Each row is constant over the step that ends at this row; row 0 initialises the graph.
        h : float
            Step (s).
        t0 : float
            Time of row 0 (s).

        Returns
        -------
        array, shape (n,) for one output, otherwise (n, n_outputs)

        Raises
        ------
        InputError
            The number of input columns is wrong, a value is not finite, or the core refuses the step.
        """
        rows = np.asarray(u, dtype=np.float64)
        if rows.ndim == 1:
            rows = rows[:, None]
        if rows.shape[1] != self.n_inputs:
            raise InputError(f"The input rows must have {self.n_inputs} values. Got {rows.shape[1]} instead.")
        if not np.isfinite(rows).all():
            row, k = np.argwhere(~np.isfinite(rows))[0]
            raise InputError(f"The input must be finite in every row. Got {rows[row, k]} in row {row}.")
        y = self.executor().run(rows, self.n_outputs, h, t0)
        return y[:, 0] if y.shape[1] == 1 else y


def is_hysteretic(graph: Graph) -> bool:
    """Return whether the graph contains a block that updates its memory at every completed step of a solver."""
    return any(n.block.rate == "hysteretic" for n in graph.nodes)


def is_sampled(graph: Graph) -> bool:
    """Return whether the graph contains a block that changes its state only at sample times."""
    return any(n.block.rate == "sampled" for n in graph.nodes)


def needs_step(graph: Graph) -> bool:
    """Return whether the outputs of the model depend on the length of its steps.

    They depend on this length if the graph contains a sampled block. They also depend on it if the input of a
    hysteretic memory changes only at steps. This is the case if the graph depends on time, or if a block in a loop uses
    outputs of the last step.
    """
    timed = any(n.block.of("time") for n in graph.nodes)
    looped = any(source >= to and place != graph.nodes[to].block.trial - 1 for to, place, source, *_ in graph.links)
    return is_sampled(graph) or ((timed or looped) and any(n.block.rate != "function" for n in graph.nodes))


DEFAULT_STEP = 1e-3  # s: step of graphs that have neither a step nor dynamics
MOST_SAMPLES = 1_000_000  # maximum number of samples in one step, as in an FMU
_PER_PERIOD = 20  # steps per period of a pole pair, or per 2 pi time constants of a real pole


def sample_time(graph: Graph) -> float | None:
    """Return the sample time (s), of which every communication step must be a multiple; None if any step is valid.

    If the graph states no step, its sampled blocks take a sample at each communication point.
    """
    return graph.step if graph.step > 0 and needs_step(graph) else None


def samples_in(period: float, t: float, h: float) -> int:
    """Return the number of samples with the given `period` (s) in a step of length `h` (s) that begins at `t` (s).

    Raises
    ------
    InputError
        The step is not a multiple of the period. The tolerance is a thousandth of the period, plus the rounding errors
        of the times.
    """
    n = math.floor(h / period + 0.5)
    off, slack = abs(h - n * period), 1e-3 * period + 16 * np.finfo(float).eps * abs(t + h)
    if not (1 <= n <= MOST_SAMPLES and off <= slack and off < 0.5 * period):
        raise InputError(
            f"The step must be a multiple (1 to {MOST_SAMPLES}) of the sample time {period!r} s of the model. "
            f"Got {h!r} s instead."
        )
    return n


def suitable_step(graph: Graph) -> float:
    """Return the step (s) of the default experiment: the step of the graph, or a step that fits its fastest pole."""
    if graph.step > 0:
        return graph.step
    pole = _fastest_pole(graph)
    if not (pole > 0 and math.isfinite(pole)):
        return DEFAULT_STEP
    step = 2 * math.pi / pole / _PER_PERIOD
    decade = 10.0 ** math.floor(math.log10(step))
    return float(f"{max(m for m in (1, 2, 5) if m * decade <= step * (1 + 1e-9)) * decade:.0e}")


def _fastest_pole(graph: Graph) -> float:
    """Return the largest modulus (1/s) of the poles in the initial state; 0 without continuous states."""
    n = len(graph.continuous_states)
    if not n:
        return 0.0
    executor = ContinuousExecutor(graph.to_bytes())
    executor.start(0.0)
    executor.evaluate(0.0)
    columns = [executor.tangent(np.zeros(graph.n_inputs), seed, graph.n_outputs)[1] for seed in np.eye(n)]
    return float(np.abs(np.linalg.eigvals(np.column_stack(columns))).max())
