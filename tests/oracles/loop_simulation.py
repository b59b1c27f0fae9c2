"""Closed loops simulated again: the units of a case in their stated order, each on the newest outputs of the others.

The package reads the files and says which unit is connected to which; everything that computes is in this file and in
loop_blocks.py.  Inverses are roots: the input for which the model has the wanted output, by Brent's method.
"""

import re

import numpy as np
from loop_blocks import BLOCKS, parameters
from scipy.optimize import brentq

_END = re.compile(r"(\w+)\.(\w+)(?:\[(\d+)\])?\Z")
WIDE = 1e3  # limits of an input that is sought, unless the model states them
SAME = 1e-13


class Inputs(dict):
    """Inputs of a block by port; one that nothing is connected to is 0."""

    def __missing__(self, port):
        return 0.0


class Blocks:
    """The blocks of a unit with their wires; a step is tried on a state and taken by keeping what it returns."""

    def __init__(self, graph):
        self.nodes = graph.nodes
        self.parameters = {n.name: parameters(n) for n in graph.nodes}
        self.shapes = {n.name: {v.name: (v.size, n.sizes[v.name]) for v in n.block.vars} for n in graph.nodes}
        self.sources = {}
        for source, to in graph.wires:
            self._connect(to, source)
        for i in graph.inputs:
            for to in i.to:
                self._connect(to, i.name)
        self.outputs = [(o.name, o.source) for o in graph.outputs]
        self.inputs = {p.name: p.scalar_names for p in graph.ports if p.kind == "input"}
        self.root = next((n for n in graph.nodes if n.type == "implicit_inverse"), None)

    def _connect(self, to, source):
        name, port, k = _END.match(to).groups()
        self.sources.setdefault((name, port), {})[int(k or 1) - 1] = source

    def _value(self, source, u, found):
        """The scalar or array that an end stands for: an input of the unit, or an output of a block."""
        if "." not in source:
            return u[source] if source in u else np.array([u[name] for name in self.inputs[source]])
        name, port, k = _END.match(source).groups()
        value = found[name][port] if name in found else 0.0
        return value if k is None else np.ravel(value)[int(k) - 1]

    def step(self, states, u, t, dt):
        """(outputs by block, states) of a step with the inputs u."""
        if self.root is None:
            return self._through(states, u, t, dt, {})
        p, name = self.parameters[self.root.name], self.root.name
        wanted = float(u[self.sources[name, "y"][0]])
        (back,) = self.sources[name, "h"].values()

        def miss(x):
            found, _ = self._through(states, u, t, dt, {name: {"u": x}})
            return float(np.ravel(self._value(back, u, found))[0]) - wanted

        return self._through(states, u, t, dt, {name: {"u": root(miss, p.lo, p.hi)}})

    def _through(self, states, u, t, dt, found):
        """Blocks step in their order, as units do: one before its source reads what the source gave last."""
        last = states["last"] if states else {}
        after = {}
        for n in self.nodes:
            if n.name in found:
                continue
            at = self._inputs(n.name, u, last | found)
            found[n.name], after[n.name] = BLOCKS[n.type](self.parameters[n.name], states and states[n.name], at, t, dt)
        return found, after | {"last": found}

    def _inputs(self, name, u, found):
        ends = ((port, ends) for (node, port), ends in self.sources.items() if node == name)
        return Inputs((port, self._input(name, port, e, u, found)) for port, e in ends)

    def _input(self, name, port, ends, u, found):
        values = [self._value(ends[k], u, found) for k in sorted(ends)]
        flat = np.concatenate([np.ravel(v) for v in values])
        return float(flat[0]) if self.shapes[name][port][0] == "1" else flat

    def results(self, found, u):
        """The scalar outputs of the unit, in the order of its ports."""
        return np.concatenate([np.ravel(self._value(source, u, found)) for _, source in self.outputs])


def root(miss, lo, hi, near=None):
    """The root of a function that rises, or the bound that is nearest to it; sought around `near` first."""
    if near is not None:
        reach = 1e-3
        while miss(near - reach) >= 0 or miss(near + reach) <= 0:
            reach *= 4
            if reach > hi - lo:
                raise ValueError("no root")
        lo, hi = near - reach, near + reach
    if miss(lo) >= 0:
        return lo
    return hi if miss(hi) <= 0 else brentq(miss, lo, hi, xtol=SAME, rtol=4 * np.finfo(float).eps)


class Inverse:
    """The unit `inverse_of`: the input for which the forward model has the wanted output, near the last one."""

    def __init__(self, graph, inputs):
        self.model, self.inputs = Blocks(graph), list(inputs)
        ((self._into,),) = self.model.inputs.values()

    def step(self, states, u, t, dt):
        (wanted,) = u.values()
        states, last = states or (None, 0.0)

        def tried(x):
            found, after = self.model.step(states, {self._into: x}, t, dt)
            return float(self.model.results(found, {})[0]), after

        x = root(lambda x: tried(x)[0] - wanted, -WIDE, WIDE, last)
        return x, (tried(x)[1], x)

    def results(self, found, u):
        return np.array([found])


class Recorded:
    """A source whose values are taken from a run of the package: noise, and signals from random numbers."""

    def __init__(self, rows):
        self.rows, self.inputs, self.k = rows, [], 0

    def step(self, states, u, t, dt):
        at = 0 if states is None else states + self.stride
        return self.rows[at], at

    def results(self, found, u):
        return found


def simulate(system, forward, recorded):
    """All outputs of a case at its fine steps.

    Parameters
    ----------
    system : System
        Read by the package; coupling gauss_seidel.
    forward : dict of str to Graph
        Models of the units that are inverses of a model, by unit.
    recorded : dict of str to array, shape (rows, outputs)
        Outputs of the units that are not computed, by unit.

    Returns
    -------
    dict of str to array, shape (rows,)
        By ``unit.output``.
    """
    case = system.case
    if case.coupling.scheme != "gauss_seidel":
        raise NotImplementedError("coupling")
    units = []
    for p in system.parts:
        if p.name in recorded:
            unit = Recorded(recorded[p.name])
            unit.stride = p.period
        else:
            unit = Inverse(forward[p.name], p.inputs) if p.name in forward else Blocks(p.graph)
        units.append(unit)
    links = [
        {system.parts[n.to].inputs[n.input]: n.source for n in system.links if n.to == k} for k in range(len(units))
    ]
    values, states, last = np.zeros(system.n_values), [None] * len(units), [None] * len(units)
    rows, fine = [], case.step / case.ripple
    for n in range(system.n_steps + 1):
        for k, (part, unit) in enumerate(zip(system.parts, units, strict=True)):
            if n % part.period:
                continue
            u = dict(part.constants) | {name: values[source] for name, source in links[k].items()}
            dt, before = (0.0, u) if n == 0 else (fine * part.period / part.substeps, last[k])
            last[k] = u
            for i in range(part.substeps if n else 1):
                share = (i + 1) / part.substeps if part.hold == "first" and n else 1.0
                at = {name: (1 - share) * before[name] + share * now for name, now in u.items()}
                found, states[k] = unit.step(states[k], at, n * fine, dt)
            out = unit.results(found, u)
            values[part.first : part.first + len(out)] = out
        rows.append(values.copy())
    return {name: np.array(rows)[:, k] for name, k in system.columns.items()}
