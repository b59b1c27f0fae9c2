"""The Validation model of the implicit inverse: its model is a sum of plays, and its unit a graph of two."""

from __future__ import annotations

import time
from pathlib import Path

import compare
import library
import numpy as np
import numpy_forms
import simulate

from hystfmu.graph import Graph, Input, Node, Output

VALIDATION = "HystFMU.Validation.Sampled.ImplicitInverse"


def graph(inverse: Node, model: Node) -> Graph:
    """The unit around one operator: y -> u."""
    x, h = (f"model.{model.block.of(k)[0].name}" for k in ("input", "output"))
    wires = [("inverse.u", x), (h, "inverse.h")]
    return Graph([inverse, model], wires, [Input("y", ("inverse.y",))], [Output("u", "inverse.u")], sort=False)


def compare_inverse(out: Path) -> compare.Outcome:
    """Simulate the Validation model and hold it against the C core, the exact inverse in numpy and the reference."""
    tested = library.classes()[VALIDATION].tree.symbols["tested"]
    given = {k: library.evaluate(e, {}) for k, e in library.modifiers(tested.class_modification).items()}
    lo, hi, h = (float(given[k]) for k in ("lo", "hi", "Ts"))
    w0, r, w = given["values"][0], *np.split(given["values"][1:], 2)
    assert not np.any(given["state0"])
    plays = {"w0": w0, "r": r, "w": w}
    began = time.perf_counter()
    rows = simulate.run(VALIDATION, out).at(h)
    seconds = time.perf_counter() - began
    y, u = rows["tested.y"], rows["tested.u"][:, None]
    unit = graph(
        Node("inverse", "implicit_inverse", {}, {"lo": lo, "hi": hi}),
        Node("model", "backlash_sum", {"n": len(r)}, plays),
    )
    expected = np.reshape(unit.run(y, h), (-1, 1))
    # beyond the upper limit the model stays at its output there: on the virgin curve, for no |u| is larger
    top = w0 * hi + np.dot(w, hi - r)
    assert np.max(y) > top
    assert lo < np.min(u) < -0.5
    reached, every = np.minimum(y, top), np.arange(len(y))
    exact = numpy_forms.outputs("PrandtlIshlinskiiInverse", reached, plays | {"u0": 0.0}, h, every)
    return compare.Outcome(
        VALIDATION,
        len(y),
        0,
        compare.relative(u, expected),
        compare.ROUNDING,
        compare.relative(u, exact),
        compare.ROUNDING,
        compare.against_reference(VALIDATION, rows["time"], u),
        compare.TUBE["Sampled"],
        seconds,
    )
