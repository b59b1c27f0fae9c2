"""Every field of a block file: the values that are taken, the first that are not, and the sentence that says so.

The files are written field by field as `fmu_build/README.md` describes them, not by the writer of the package.
"""

import ctypes as C
import struct
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from hystfmu import Graph, Input, InputError, Node, Output
from hystfmu.core.executor import Executor
from hystfmu.core.library import RawError, block_types, library

DAMAGED = "the block file is damaged or not a block file"
SIZE, WIRING = "a size is out of range", "a connection names a port that does not exist"
KINDS = {"param": 0, "fixed": 1, "input": 3, "output": 5}


def u32(*values: int) -> bytes:
    return struct.pack(f"<{len(values)}I", *(v % 2**32 for v in values))


def f64(*values: float) -> bytes:
    return struct.pack(f"<{len(values)}d", *values)


def name(text: bytes) -> bytes:
    return u32(len(text)) + text


def file(body: bytes, step: float = 0.0, version: int = 2, token: bytes = b"t") -> bytes:
    covered = token.ljust(40, b"\0") + f64(step) + body
    return b"HYSTFMU\n" + u32(version, 20 + len(covered), zlib.crc32(covered)) + covered


def gain(label: bytes = b"g", n: int = 1, values: Sequence[float] = (2.0, 0.0, -1e300, 1e300)) -> bytes:
    """A block `scaling`: name, type, sizes, values of gain, offset, lo, hi."""
    return name(label) + name(b"scaling") + u32(1, n, len(values)) + f64(*values)


def port(label: bytes, kind: int, block: int, row: int, at: int, size: int = 1) -> bytes:
    return name(label) + u32(kind, block, row, at, size)


ROWS = [v.name for v in block_types()["scaling"].vars]
U, Y = ROWS.index("u"), ROWS.index("y")
PORTS = [port(b"u", KINDS["input"], 0, U, 0), port(b"y", KINDS["output"], 1, Y, 0)]
WIRES = [(0, 0, -1, 0, 1), (1, 0, 0, 0, 1)]


def chain(
    nodes: Sequence[bytes] = (gain(b"a"), gain(b"b")),
    starts: Sequence[float] = (0.25,),
    wires: Sequence[tuple[int, ...]] = WIRES,
    ports: Sequence[bytes] = PORTS,
    counts: dict[str, int] | None = None,
    **header: Any,
) -> bytes:
    """Two gains of 2, one after the other."""
    n = {"nodes": len(nodes), "starts": len(starts), "wires": len(wires), "ports": len(ports)} | (counts or {})
    body = u32(n["nodes"]) + b"".join(nodes) + u32(n["starts"]) + f64(*starts)
    body += u32(n["wires"]) + b"".join(u32(*w) for w in wires) + u32(n["ports"]) + b"".join(ports)
    return file(body, **header)


def said(content: bytes) -> str:
    """The sentence of the refusal; nothing if the file is taken."""
    try:
        Executor(content)
    except InputError as e:
        return str(e)
    return ""


def test_the_description_is_that_of_the_writer() -> None:
    e = Executor(chain())
    e.start(0.0)
    assert e.get(0) == 0.25
    assert e.get(1) == 1.0
    assert e.run(np.array([[0.5], [-3.0]]), 1, 0.1).tolist() == [[2.0], [-12.0]]
    nodes = [Node("a", "scaling", {}, {"gain": [2.0]}), Node("b", "scaling", {}, {"gain": [2.0]})]
    graph = Graph(nodes, [("a.y", "b.u")], [Input("u", ("a.u",))], [Output("y", "b.y")])
    parameters = [p for p in graph.ports if p.kind not in ("input", "output")]
    written, own = graph.to_bytes(), chain(starts=[0.0])
    assert (
        written[68:][: len(own) - 68 - len(PORTS[0]) - len(PORTS[1]) - 4]
        == own[68 : -len(PORTS[0]) - len(PORTS[1]) - 4]
    )
    assert len(written) == len(own) + sum(4 + len(p.name) + 20 for p in parameters)


def test_every_beginning_of_a_file_is_refused() -> None:
    whole = chain()
    for n in range(len(whole)):
        cut = whole[:n]
        assert said(cut).startswith(DAMAGED)
        if n >= 20:  # as a file of its own
            cut = whole[:12] + u32(n, zlib.crc32(cut[20:])) + cut[20:]
            assert said(cut).startswith((DAMAGED, SIZE)), n
        if n in (67, 68):
            assert said(cut) == f"{DAMAGED}: {'header' if n == 67 else 'number of blocks'}"
    values = 72 + len(gain()) - 32  # those of the first block begin here
    for n in range(values, values + 32):
        assert said(file(whole[68:n])) == f"{DAMAGED} at scaling: number of values"
    assert said(file(whole[68 : values + 32])) == f"{DAMAGED}: name of a block"
    assert said(file(whole[68:] + b"\0")) == f"{DAMAGED}: bytes after the end"


@pytest.mark.parametrize(("content", "sentence"), [
    (b"hYSTFMU\n" + chain()[8:], f"{DAMAGED}: header"),
    (chain(version=1), "the block file has a version that this binary does not read"),
    (chain(version=3), "the block file has a version that this binary does not read"),
    (chain()[:12] + u32(7) + chain()[16:], f"{DAMAGED}: length"),
    (chain()[:-1] + b"\1", "the block file is damaged: its checksum does not match"),
    (chain(token=b"t" * 40), f"{DAMAGED}: token"),
    (chain(token=b"t" * 39), ""),
    (chain(step=1e300), ""),
    (chain(step=-5e-324), f"{DAMAGED}: step"),
    *((chain(step=step), f"{DAMAGED}: step") for step in (np.inf, np.nan)),
])  # fmt: skip
def test_header(content: bytes, sentence: str) -> None:
    assert said(content) == sentence


@pytest.mark.parametrize(("nodes", "counts", "sentence"), [
    ([], {}, f"{DAMAGED}: number of blocks"),
    ([gain(b"a"), gain(b"b")], {"nodes": 1001}, f"{DAMAGED}: number of blocks"),
    ([gain(b"a"), gain(b"b")], {"nodes": 2**32 - 1}, f"{DAMAGED}: number of blocks"),
    ([gain(b""), gain(b"b")], {}, f"{DAMAGED}: name of a block"),
    ([gain(b"a" * 255), gain(b"b")], {}, ""),
    ([gain(b"a" * 256), gain(b"b")], {}, f"{DAMAGED}: name of a block"),
    ([gain(b"a\0a"), gain(b"b")], {}, f"{DAMAGED}: name of a block"),
    ([gain(b"a").replace(b"scaling", b"scalinG"), gain(b"b")], {}, "this binary has no block of this name: scalinG"),
    ([gain(b"a", n=0), gain(b"b")], {}, f"{SIZE} at scaling.n"),
    ([gain(b"a", n=100001), gain(b"b")], {}, f"{SIZE} at scaling.n"),
    ([name(b"a") + name(b"scaling") + u32(2, 1, 1), gain(b"b")], {}, f"{SIZE} at scaling: number of sizes"),
    ([gain(b"a", values=(0.0,) * 3), gain(b"b")], {}, f"{DAMAGED} at scaling: number of values"),
    ([gain(b"a", values=(0.0,) * 5), gain(b"b")], {}, f"{DAMAGED} at scaling: number of values"),
    ([gain(b"a", values=(np.nan, 0.0, -1.0, 1.0)), gain(b"b")], {},
     "The 'gain' parameter of a must be a float in (-inf, inf). Got nan instead."),
])  # fmt: skip
def test_blocks(nodes: list[bytes], counts: dict[str, int], sentence: str) -> None:
    assert said(chain(nodes, counts=counts)) == sentence


def test_as_many_blocks_as_the_limit() -> None:
    for n, sentence in ((1000, ""), (1001, f"{DAMAGED}: number of blocks")):
        wires = [(k, 0, k - 1, 0, 1) for k in range(n)]
        ports = [PORTS[0], port(b"y", KINDS["output"], n - 1, Y, 0)]
        nodes = [gain(b"g", values=(1.0, 0.001, -1e300, 1e300)) for _ in range(n)]
        content = chain(nodes, wires=wires, ports=ports)
        assert said(content) == sentence
        if not sentence:
            assert Executor(content).run(np.array([[0.5]]), 1, 0.1)[0, 0] == pytest.approx(1.5, rel=1e-12)


@pytest.mark.parametrize(("starts", "counts", "sentence"), [
    ([np.nan], {}, f"{DAMAGED}: start value of an input"), ([np.inf], {}, f"{DAMAGED}: start value of an input"),
    ([0.0], {"starts": 2**31}, f"{DAMAGED}: number of inputs"), ([0.0, 1.0], {}, ""), ([], {}, WIRING),
])  # fmt: skip
def test_inputs(starts: list[float], counts: dict[str, int], sentence: str) -> None:
    assert said(chain(starts=starts, counts=counts)).startswith(sentence)
    assert bool(said(chain(starts=starts, counts=counts))) == bool(sentence)


@pytest.mark.parametrize(("key", "width", "what"), [("starts", 8, "inputs"), ("wires", 20, "connections")])
def test_a_number_that_exceeds_the_rest_of_the_file(key: str, width: int, what: str) -> None:
    rest = (12 if key == "starts" else 0) + 20 * len(WIRES) + 4 + sum(map(len, PORTS))
    for n in (rest // width, rest // width + 1):
        assert (said(chain(counts={key: n})) == f"{DAMAGED}: number of {what}") == (n > rest // width)


@pytest.mark.parametrize(("wires", "counts", "sentence"), [
    (WIRES, {"wires": 100001}, f"{DAMAGED}: number of connections"),
    (WIRES, {"wires": 100}, f"{DAMAGED}: number of connections"),
    ([(1, 0, 0, 0, 1), (0, 0, -1, 0, 1)], {}, WIRING),  # sorted by the node that reads
    ([(-1, 0, -1, 0, 1)], {}, WIRING),
    ([(2, 0, -1, 0, 1)], {}, WIRING),
    ([(0, 0, -2, 0, 1)], {}, WIRING),
    ([(0, 0, 2, 0, 1)], {}, WIRING),
    ([(0, -1, -1, 0, 1)], {}, WIRING),
    ([(0, 1, -1, 0, 1)], {}, f"{WIRING} at a"),
    ([(0, 0, -1, -1, 1)], {}, WIRING),
    ([(0, 0, -1, 1, 1)], {}, f"{WIRING} at a"),
    ([(0, 0, -1, 0, 0)], {}, WIRING),
    ([(0, 0, -1, 0, 2)], {}, f"{WIRING} at a"),
    ([(0, 0, -1, 0, 1), (1, 0, 0, 1, 1)], {}, f"{WIRING} at b"),
    ([(0, 0, 1, 0, 1), (1, 0, 0, 0, 1)], {}, "algebraic loop: a <- b <- a"),
    ([(0, 0, 0, 0, 1)], {}, "algebraic loop: a <- a"),
    ([], {}, ""),
])  # fmt: skip
def test_wires(wires: list[tuple[int, ...]], counts: dict[str, int], sentence: str) -> None:
    assert said(chain(wires=wires, counts=counts)) == sentence


@pytest.mark.parametrize(("ports", "counts", "sentence"), [
    (PORTS, {"ports": 1000001}, f"{DAMAGED}: number of variables"),
    (PORTS, {"ports": 1000000}, f"{DAMAGED}: a variable"),
    ([port(b"", 3, 0, U, 0)], {}, f"{DAMAGED}: a variable"),
    ([port(b"u", 3, 0, U, 0, 0)], {}, f"{DAMAGED}: a variable"),
    ([port(b"u", 3, 0, U, 0, 2**24 + 1)], {}, f"{DAMAGED}: a variable"),
    ([port(b"u", 3, 2, U, 0)], {}, f"{WIRING} at u"),
    ([port(b"u", 3, -1, U, 0)], {}, f"{WIRING} at u"),
    ([port(b"u", 3, 0, len(ROWS), 0)], {}, f"{WIRING} at u"),
    ([port(b"u", 3, 0, Y, 0)], {}, f"{WIRING} at u"),
    ([port(b"u", 3, 0, U, 1)], {}, f"{WIRING} at u"),
    ([port(b"u", 3, 0, U, 0, 2)], {}, f"{WIRING} at u"),
    ([port(b"y", 5, 0, Y, 1)], {}, f"{WIRING} at y"),
    ([port(b"y", 5, 0, Y, 0, 2)], {}, f"{WIRING} at y"),
    ([port(b"p", 0, 0, ROWS.index("gain"), 0)], {}, ""),
    ([port(b"p", 1, 0, ROWS.index("gain"), 0)], {}, f"{WIRING} at p"),
    ([port(b"p", 0, 0, ROWS.index("gain"), 1)], {}, f"{WIRING} at p"),
    ([], {}, ""),
])  # fmt: skip
def test_ports(ports: list[bytes], counts: dict[str, int], sentence: str) -> None:
    assert said(chain(ports=ports, counts=counts)) == sentence


@pytest.mark.parametrize("filling", [0x00, 0xFF, 0x7F])
def test_the_memory_of_a_graph_may_have_held_anything(filling: int) -> None:
    """malloc clears nothing; and the size that was measured is enough, one byte less is not."""
    lib, error, size = library(), RawError(), C.c_size_t()
    content = Graph.single(Node("p", "pid")).to_bytes()
    assert lib.hyst_graph_measure(content, len(content), C.byref(size), C.byref(error)) == 0
    room = (C.c_ubyte * (size.value + 32))(*[filling] * (size.value + 32))
    begin = -C.addressof(room) % 16
    handle = C.c_void_p()

    def opened(n: int) -> int:
        at = C.c_void_p(C.addressof(room) + begin)
        return int(lib.hyst_graph_open(content, len(content), at, n, C.byref(handle), C.byref(error)))

    assert opened(size.value - 1) != 0
    assert not handle.value
    assert opened(size.value) == 0
    assert bytes(room[begin + size.value :]) == bytes([filling]) * (32 - begin)
    n = C.c_int64()
    fresh = Executor(content)
    state = lib.hyst_graph_state(handle, C.byref(n))
    assert state[: n.value] == fresh.state.tolist()
    for t in (0.1, 0.2):
        assert lib.hyst_graph_step(handle, t, 0.1) == 0
        fresh.step(t, 0.1)
    assert state[: n.value] == fresh.state.tolist()
