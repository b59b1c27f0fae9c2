"""The block file (`resources/block.bin`): a graph serialised for the core.  `fmu_build/README.md` has the format."""

from __future__ import annotations

import binascii
import hashlib
import struct
from collections.abc import Sequence

from hystfmu.graph.node import Node
from hystfmu.graph.ports import Port

MAGIC, VERSION = b"HYSTFMU\n", 2
_TOKEN = 40


def block_file(
    step: float, nodes: Sequence[Node], links: Sequence[tuple[int, int, int, int, int]], ports: Sequence[Port]
) -> bytes:
    """Serialise a graph.

    Parameters
    ----------
    step : float
        Sample period (s); 0 if the graph states none.
    nodes : sequence of Node
        Blocks in evaluation order.
    links : sequence of (node, place, source or -1, place, size)
        Wires, sorted by node.
    ports : sequence of Port
        Ports in the order of their value references.

    Returns
    -------
    bytes
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
    """Return the token of a block file, a hash of the bytes that follow it."""
    return file[len(MAGIC) + 12 :][:_TOKEN].rstrip(b"\0").decode()
