"""Connections and equations of a block for the wires of a graph. The ports of the block are in SI units."""

import re
from dataclasses import dataclass

from hystfmu.core.library import Var
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.modelica import classes
from hystfmu.modelica.layout import Point, Spots, line, on_component, placed, port_at
from hystfmu.modelica.literals import number
from hystfmu.modelica.measures import si, zero
from hystfmu.modelica.record import field

_END = re.compile(r"(\w+)\.(\w+)(?:\[(\d+)\])?\Z")


@dataclass(frozen=True)
class Wiring:
    """A graph, and the names and positions of its ports and components in the block.

    Attributes
    ----------
    graph : Graph
    ports, parts : dict of str to str
        Names of the ports and of the components in the block, by their names in the graph.
    where : Spots
        Positions of ports and components in the diagram.
    inlined : frozenset of str
        Names of nodes that become an equation instead of a component, see `inlined_before_samples`.
    """

    graph: Graph
    ports: dict[str, str]
    parts: dict[str, str]
    where: Spots
    inlined: frozenset[str] = frozenset()

    def row(self, end: str) -> tuple[Node, Var, str | None]:
        """Return node, variable and index of an end of a wire; the index is None if the end has no index."""
        m = _END.match(end)
        assert m is not None  # the graph has checked the names of all ends
        node = self.graph.node(m[1])
        return node, next(v for v in node.block.of("input", "output") if v.name == m[2]), m[3]

    def end(self, end: str) -> str:
        """Return the name of an end of a wire in the block.

        A vector of one element gets an index, because the other end may be a scalar.
        """
        node, v, index = self.row(end)
        if node.name in self.inlined:
            return self.parts[node.name]
        if index is None and v.size != "1" and node.sizes[v.name] == 1:
            index = "1"
        return f"{self.parts[node.name]}.{v.name}" + (f"[{index}]" if index and v.size != "1" else "")

    def point(self, end: str) -> Point:
        """Return the position of an end of a wire in the diagram."""
        node, v, _ = self.row(end)
        if node.name in self.inlined:
            return self.where.of[node.name]
        rows = node.block.of(v.kind)
        return on_component(port_at(v.kind == "input", rows.index(v), len(rows)), self.where.of[node.name])

    def between(self, a: str, b: str) -> str:
        """Return the equation ``connect(...)``, with its line in the diagram, for the wire from `a` to `b`."""
        return f"  connect({self.end(a)}, {self.end(b)}) {line(self.point(a), self.point(b))};"

    def from_port(self, p: Input, i: int) -> list[str]:
        """Return the connections from the input `p`, port i, to components.

        An element of a vector gets an equation instead of a connection. The reason is the Modelica compiler rumoca
        0.10.2, which treats an array as a whole: with a connection, the port would seem to depend on the sources of the
        other elements.
        """
        name, found = self.ports[p.name], []
        for to in p.to:
            if to.split(".")[0] in self.inlined:
                continue
            end = self.end(to)
            value = counted(name, p.unit) + (f"/{self._scale(p, to)}" if si(p.unit)[0] else "")
            if value != name or end.endswith("]"):
                found.append(f"  {end} = {value};")
            else:
                at = port_at(True, i, len(self.graph.inputs), self.where.edge)
                found.append(f"  connect({name}, {end}) {line(at, self.point(to))};")
        return found

    def to_port(self, o: Output, i: int) -> str:
        """Return the connection from a component to the output `o`, port i."""
        name = self.ports[o.name]
        if si(o.unit)[0]:
            above = f"{zero_constant(name)} + " if zero(o.unit) else ""
            return f"  {name} = {above}{self._scale(o, o.source)}*{self.end(o.source)};"
        at = port_at(False, i, len(self.graph.outputs), self.where.edge)
        return f"  connect({self.end(o.source)}, {name}) {line(self.point(o.source), at)};"

    def inline(self, name: str) -> tuple[str, str]:
        """Return the declaration and the equation of a node that has no component, see `inlined`."""
        node, part = self.graph.node(name), self.parts[name]
        is_sum = node.type == "sum"
        k = f"values.{field(self.graph, node, 'k')}" if is_sum else ""
        terms = [f"values.{field(self.graph, node, 'offset')}"] if is_sum else []
        for i in range(1, node.sizes["u"] + 1):
            to = {f"{name}.u[{i}]"} | ({f"{name}.u"} if node.sizes["u"] == 1 else set())
            wire = next((a for a, b in self.graph.wires if b in to), None)
            port = next((p for p in self.graph.inputs if to & set(p.to)), None)
            if wire is not None:
                terms.append(f"{k}[{i}]*" * is_sum + self.end(wire))
            elif port is not None:
                own = self.ports[port.name]
                scaled = f"/{unit_constant(own)}" if si(port.unit)[0] else ""
                terms.append(f"{k}[{i}]*" * is_sum + f"{counted(own, port.unit)}{scaled}")
            elif not is_sum:
                terms.append("0")  # an input that nothing drives
        where, what = placed(*self.where.of[name]), "Weighted sum" if is_sum else "Product"
        return (
            f'  HystFMU.Interfaces.RealOutput {part} "{what}" annotation ({where});',
            f"  {part} = {(' + ' if is_sum else '*').join(terms)};",
        )

    def _scale(self, p: Input | Output, end: str) -> str:
        """Return the factor from the unit of measure of a port to its SI unit.

        The factor is a number if the component has a unit, otherwise a constant of the block.
        """
        own = self.row(end)[1].unit
        return number(si(p.unit)[1]) if own != "1" else unit_constant(self.ports[p.name])

    def shape(self, end: str) -> str:
        """Return the size of a port of the block in brackets, from the size of the connected end; "" for a scalar."""
        node, v, index = self.row(end)
        size = node.sizes[v.name]
        return f"[{size}]" if index is None and size > 1 else ""

    def unconnected(self, nodes: list[Node]) -> list[str]:
        """Return equations that set all unconnected inputs of nodes to their start values."""
        driven = {b for _, b in self.graph.wires} | {b for p in self.graph.inputs for b in p.to}
        found = []
        for node in nodes:
            for v in node.block.of("input"):
                if f"{node.name}.{v.name}" in driven:
                    continue
                for end in (f"{v.name}[{k + 1}]" for k in range(node.sizes[v.name])):
                    if f"{node.name}.{end}" not in driven:
                        inner = v.name if v.size == "1" else end
                        found.append(f"  {self.parts[node.name]}.{inner} = {number(v.start)};")
        return found


def inlined_before_samples(graph: Graph) -> frozenset[str]:
    """Return the names of the sums and products that must become equations instead of components.

    These are the sums whose output drives a sampled block, and the products without divisors whose output drives such a
    sum or a sampled block. The Modelica compiler rumoca 0.10.2 treats the vector u of Dynamics.Sum as a whole. If a
    sampled block drives such a sum, a sampled block after the sum gets an old value. An equation of scalars gives the
    new value. The same is true for Dynamics.Product.
    """

    def before(names: set[str]) -> set[str]:
        return {a.split(".")[0] for a, b in graph.wires if b.split(".")[0] in names}

    sampled = {n.name for n in graph.nodes if classes.is_sampled(n)}
    sums = {n.name for n in graph.nodes if n.type == "sum"} & before(sampled)
    products = {n.name for n in graph.nodes if n.type == "product" and not n.dims["m"]} & before(sampled | sums)
    return frozenset(sums | products)


def unit_constant(port: str) -> str:
    """Return the name of the constant with the SI value of one unit of measure of a port."""
    return f"{port}_unit"


def zero_constant(port: str) -> str:
    """Return the name of the constant with the SI value of 0 in the unit of measure of a port, such as 273.15 K."""
    return f"{port}_zero"


def counted(port: str, unit: str) -> str:
    """Return the expression of a port minus the offset of its unit of measure, such as 273.15 K for degC."""
    return f"({port} - {zero_constant(port)})" if zero(unit) else port
