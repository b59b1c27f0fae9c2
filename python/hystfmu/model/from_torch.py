"""Conversion of a `torch.nn` network to a graph of `mlp` blocks.

Each `mlp` block contains a linear layer, an activation, and a second linear layer. If a linear layer is missing, an
identity matrix takes its place. If an activation is missing, the exact identity relu(a) - relu(-a) = a is used. The
weights are converted from float32 to float64 without loss, and the model computes in float64.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.graph import Graph, Input, Node, Output, Value

if TYPE_CHECKING:
    from torch import nn

__all__ = ["torch_graph"]

SUPPORTED = ("Linear", "Sigmoid", "Tanh", "ReLU", "Identity", "Sequential")
_ACTIVATIONS = {"Sigmoid": "sigmoid", "Tanh": "tanh", "ReLU": "relu"}


@dataclass(frozen=True)
class _Affine:
    W: Array
    b: Array


def torch_graph(module: "nn.Module") -> Graph:
    """Convert a network to a graph with input `u` (n_in,) and output `y` (n_out,); see `hystfmu.Model.from_torch`.

    The graph is a chain of ``mlp`` blocks named net1, net2, ...

    Raises
    ------
    InputError
        A layer of `module` is not supported, sizes do not match, a weight is not finite, or there is no Linear layer.
    """
    layers = _layers(module)
    widths = [layer for layer in layers if isinstance(layer, _Affine)]
    if not widths:
        raise InputError("The network must have a Linear layer, which states its size. Got none.")
    nodes: list[Node] = []
    at, width = 0, widths[0].W.shape[1]
    while at < len(layers):
        first, at = _affine(layers, at, width)
        if at < len(layers) and isinstance(layers[at], str):
            activation, at = str(layers[at]), at + 1
            last, at = _affine(layers, at, len(first.b))
        else:  # no activation: relu(a) - relu(-a) = a
            activation, n = "relu", len(first.b)
            first = _Affine(np.vstack([first.W, -first.W]), np.concatenate([first.b, -first.b]))
            last = _Affine(np.hstack([np.eye(n), -np.eye(n)]), np.zeros(n))
        width = len(last.b)
        values: dict[str, Value] = {
            "W1": first.W.ravel(),
            "b1": first.b,
            "W2": last.W.ravel(),
            "b2": last.b,
            "activation": activation,
        }
        dims = {"n_in": first.W.shape[1], "n_hidden": len(first.b), "n_out": width}
        nodes.append(Node(f"net{len(nodes) + 1}", "mlp", dims, values))
    inputs = [Input("u", (f"{nodes[0].name}.u",), text="inputs of the network")]
    output = Output("y", f"{nodes[-1].name}.y", text="outputs of the network")
    return Graph(nodes, [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(nodes)], inputs, [output])


def _layers(module: "nn.Module") -> list[_Affine | str]:
    """Check the layers of a network, and return linear layers as arrays and activations as names, in order."""
    out: list[_Affine | str] = []
    width: int | None = None
    for path, layer in _flat(module, ""):
        kind = type(layer).__name__
        where = f"layer {path or 0} ({kind})"
        if kind == "Linear":
            w = layer.weight.detach().cpu().double().numpy()
            b = np.zeros(len(w)) if layer.bias is None else layer.bias.detach().cpu().double().numpy()
            if width is not None and w.shape[1] != width:
                raise InputError(
                    f"The {where} must take the {width} values of its predecessor. Got {w.shape[1]} instead."
                )
            if not (np.isfinite(w).all() and np.isfinite(b).all()):
                bad = next(v for v in np.concatenate([w.ravel(), b]) if not np.isfinite(v))
                raise InputError(f"The weights of {where} must be finite. Got {bad} instead.")
            width = len(w)
            out.append(_Affine(w, b))
        elif kind in _ACTIVATIONS:
            out.append(_ACTIVATIONS[kind])
        elif kind != "Identity":
            raise InputError(f"The layers of a network must be among {', '.join(SUPPORTED)}. Got {where} instead.")
    return out


def _flat(module: "nn.Module", path: str) -> Iterator[tuple[str, Any]]:
    """Yield the layers of nested Sequentials in order, each with its path in torch notation (0, 1.0, 1.1, ...)."""
    if type(module).__name__ != "Sequential":
        yield path, module
        return
    for name, child in module.named_children():
        yield from _flat(child, f"{path}.{name}" if path else name)


def _affine(layers: list[_Affine | str], at: int, width: int) -> tuple[_Affine, int]:
    """Return the linear layer at index `at` and the next index; if the layer is not linear, return an identity.

    If the result is an identity, the returned index is `at`. `width` is the number of its inputs.
    """
    if at < len(layers) and isinstance(layer := layers[at], _Affine):
        return layer, at + 1
    return _Affine(np.eye(width), np.zeros(width)), at
