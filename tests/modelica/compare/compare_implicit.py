"""The Validation model of the implicit inverse: its model is a sum of plays, and its unit a graph of two."""

import library
import numpy as np
import simulate
from compare_operator import ROUNDING
from outcome import Outcome, relative

from hystfmu.graph import Graph, Input, Node, Output


def is_implicit(name: str) -> bool:
    """Is it the Validation model of the implicit inverse?"""
    return name == "HystFMU.Validation.Sampled.ImplicitInverse"


def graph(inverse: Node, model: Node) -> Graph:
    """The unit around one operator: y -> u."""
    x, h = (f"model.{model.block.of(k)[0].name}" for k in ("input", "output"))
    wires = [("inverse.u", x), (h, "inverse.h")]
    return Graph([inverse, model], wires, [Input("y", ("inverse.y",))], [Output("u", "inverse.u")], sort=False)


def compare(name: str) -> Outcome:
    """Simulate the Validation model and compare it with the C core."""
    tested = library.classes()[name].tree.symbols["tested"]
    given = {k: library.evaluate(e, {}) for k, e in library.modifiers(tested.class_modification).items()}
    lo, hi, h = (float(given[k]) for k in ("lo", "hi", "Ts"))
    w0, r, w = given["values"][0], *np.split(given["values"][1:], 2)
    assert not np.any(given["state0"])
    plays = {"w0": w0, "r": r, "w": w}
    trajectory = simulate.run(name)
    rows = trajectory.at(h)
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
    return Outcome(name, len(y), trajectory.events, trajectory.seconds, error_c=relative(u, expected), bound_c=ROUNDING)
