"""Corner cases of the reader of block files, and of graphs that only hand-made files contain."""

import ctypes as C
import struct

import numpy as np
import pytest
from block_files import input_between_outputs, patched
from raw import function

from hystfmu.base.errors import InputError
from hystfmu.core.executor import ContinuousExecutor, Executor
from hystfmu.graph import Graph, Input, Node, Output


def test_a_port_of_an_internal_row_is_refused() -> None:
    node = Node("c", "creep")
    file = Graph.single(node).to_bytes()  # the last port: kind, block, row, place, elements
    rows = [v.name for v in node.block.vars]
    for kind, name in ((2, None), (6, "q"), (7, None)):
        row = rows.index(name) if name else len(rows) - 1
        with pytest.raises(InputError):
            Executor(patched(file, -20, struct.pack("<III", kind, 0, row)))
    with pytest.raises(InputError):  # an output with more elements than its row
        Executor(patched(file, -4, struct.pack("<I", 2)))


def test_a_file_that_asks_for_too_much_memory_is_refused() -> None:
    wide = Node("n", "mlp", {"n_in": 1, "n_hidden": 1})
    file = Graph.single(wide).to_bytes()
    at = 68 + 4 + 4 + 1 + 4 + 3 + 4
    most = [d.hi for d in wide.block.dims]
    with pytest.raises(InputError, match=r"too many values|number of values"):
        Executor(patched(file, at, struct.pack(f"<{len(most)}I", *most)))


def test_what_is_no_output_is_left_out_of_the_row_of_outputs() -> None:
    u = np.array([[1.0], [-2.0]])
    assert Executor(input_between_outputs()[0]).run(u, 2, 0.1).tolist() == [[2.0, 3.0], [-4.0, -6.0]]


def test_blocks_that_together_ask_for_too_much_memory_are_refused() -> None:
    deep = [Node(f"z{k}", "zhao_tan", {"depth": 100000}) for k in range(90)]
    wires = [(f"z{k}.h", f"z{k + 1}.x") for k in range(89)]
    with pytest.raises(InputError, match="too many values"):
        Graph(deep, wires, [Input("x", ("z0.x",))], [Output("h", "z89.h")]).executor()


def test_the_tangent_leaves_out_what_is_no_output() -> None:
    e = Executor(input_between_outputs()[0])
    e.start(0.0)
    dy, none = (C.c_double * 2)(), (C.c_double * 1)()
    tangent = function("hyst_graph_tangent", C.c_void_p, *[C.POINTER(C.c_double)] * 4, result=None)
    tangent(e.handle, (C.c_double * 1)(0.5), none, dy, none)
    assert list(dy) == [1.0, 1.5]


@pytest.mark.parametrize(("y", "u"), [(0.0, 0.0), (-2e299, -0.5)], ids=["near end first", "far end first"])
def test_a_root_beside_a_cliff(y: float, u: float) -> None:
    """Where the outputs at the ends of a bracket are 1e600 : 1 a secant fails: bisection finds the root."""
    nodes = [
        Node("inverse", "implicit_inverse", {}, {"lo": -1.0, "hi": 1.0}),
        Node("cliff", "dead_zones", {"n": 1}, {"w0": 1e-300, "r": [-0.3], "w": [1e300]}),
    ]
    wires = [("inverse.u", "cliff.u"), ("cliff.y", "inverse.h")]
    graph = Graph(nodes, wires, [Input("y", ("inverse.y",))], [Output("u", "inverse.u")])
    assert graph.run(np.array([[y], [-2.7e-301]])) == pytest.approx([u, -0.27], abs=1e-12)


def test_argument_types_of_a_test_do_not_reach_the_binding() -> None:
    """They belong to the process: once `hyst_graph_tangent` took arrays here, addresses failed in other modules."""
    graph = Graph.single(Node("s", "scaling"))
    c = ContinuousExecutor(graph.to_bytes())
    c.start(0.0)
    test_the_tangent_leaves_out_what_is_no_output()
    assert c.tangent(np.array([1.0]), np.zeros(0), 1)[0].tolist() == [1.0]
