"""A user's `torch.nn` network as blocks: `from_torch(module)` is a Model, which predicts, saves and exports.

Every block `mlp` takes Linear, activation, Linear.  What a network has less of than that is filled in exactly: an
identity matrix for a missing Linear, and relu(a) - relu(-a) = a for a missing activation.  float32 weights become
float64 without loss; the model then computes in float64.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Input, Node, Output, Value
from hystfmu.model.model import Model

if TYPE_CHECKING:
    from torch import nn

__all__ = ["from_torch", "torch_blocks"]

SUPPORTED = ("Linear", "Sigmoid", "Tanh", "ReLU", "Identity", "Sequential")
_ACTIVATIONS = {"Sigmoid": "sigmoid", "Tanh": "tanh", "ReLU": "relu"}


@dataclass(frozen=True)
class _Affine:
    W: Array
    b: Array


def from_torch(module: nn.Module, text: str = "", step: float | None = None) -> Model:
    """A feed-forward network as a model with the input `u` (n_in values) and the output `y` (n_out values).

    Parameters
    ----------
    module : torch.nn.Module
        A Linear, or a Sequential (nested or not) of Linear, Sigmoid, Tanh, ReLU and Identity.  Its present weights are
        copied; training it further does not change the model.
    text : str
        One line for a reader.
    step : float, optional
        Sample step in s, recorded with the model; a network has no memory and needs none.

    Returns
    -------
    Model
        Key ``torch_mlp``; a chain of blocks ``mlp`` named net1, net2, ...

    Raises
    ------
    InputError
        A layer of another kind, sizes that do not fit each other, a weight that is not finite, no Linear at all.
    """
    nodes, wires = torch_blocks(module)
    inputs = [Input("u", (f"{nodes[0].name}.u",), text="inputs of the network")]
    graph = Graph(nodes, wires, inputs, [Output("y", f"{nodes[-1].name}.y", text="outputs of the network")])
    weights = sum(p.numel() for p in module.parameters())
    return Model("torch_mlp", graph, step, text or "network of the user (torch.nn)", {"parameters": weights})


def torch_blocks(module: nn.Module, name: str = "net") -> tuple[list[Node], list[tuple[str, str]]]:
    """The same as nodes and wires, for a graph of the caller's: behind an operator, between scalings.

    Parameters
    ----------
    module : torch.nn.Module
        As in `from_torch`.
    name : str
        The nodes are called name1, name2, ...

    Returns
    -------
    nodes : list of Node
        The first has the input `u`, the last the output `y`.
    wires : list of (str, str)

    Raises
    ------
    InputError
        As in `from_torch`.
    """
    layers = _layers(module)
    widths = [layer for layer in layers if isinstance(layer, _Affine)]
    if not widths:
        raise InputError("the network has no Linear layer, so that its size is not known")
    nodes: list[Node] = []
    at, width = 0, widths[0].W.shape[1]
    while at < len(layers):
        first, at = _affine(layers, at, width)
        if at < len(layers) and isinstance(layers[at], str):
            activation, at = str(layers[at]), at + 1
            last, at = _affine(layers, at, len(first.b))
        else:  # nothing bends here: through relu both ways
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
        nodes.append(Node(f"{name}{len(nodes) + 1}", "mlp", dims, values))
    return nodes, [(f"{name}{i}.y", f"{name}{i + 1}.u") for i in range(1, len(nodes))]


def _layers(module: nn.Module) -> list[_Affine | str]:
    """Linear layers as arrays, activations as words, in order; checked."""
    out: list[_Affine | str] = []
    width: int | None = None
    for path, layer in _flat(module, ""):
        kind = type(layer).__name__
        where = f"layer {path or 0} ({kind})"
        if kind == "Linear":
            w = layer.weight.detach().cpu().double().numpy()
            b = np.zeros(len(w)) if layer.bias is None else layer.bias.detach().cpu().double().numpy()
            if width is not None and w.shape[1] != width:
                raise InputError(f"{where} takes {w.shape[1]} values, but the layer before it gives {width}")
            if not (np.isfinite(w).all() and np.isfinite(b).all()):
                raise InputError(f"{where} has a weight that is not finite")
            width = len(w)
            out.append(_Affine(w, b))
        elif kind in _ACTIVATIONS:
            out.append(_ACTIVATIONS[kind])
        elif kind != "Identity":
            raise InputError(f"{where} cannot become a block; layers that can: {', '.join(SUPPORTED)}")
    return out


def _flat(module: nn.Module, path: str) -> Iterator[tuple[str, Any]]:
    """The layers of nested Sequentials in order, with their paths as in torch: 0, 1.0, 1.1, .."""
    if type(module).__name__ != "Sequential":
        yield path, module
        return
    for name, child in module.named_children():
        yield from _flat(child, f"{path}.{name}" if path else name)


def _affine(layers: list[_Affine | str], at: int, width: int) -> tuple[_Affine, int]:
    """The Linear at this place, or an identity where there is none, and the place after it."""
    if at < len(layers) and isinstance(layer := layers[at], _Affine):
        return layer, at + 1
    return _Affine(np.eye(width), np.zeros(width)), at
