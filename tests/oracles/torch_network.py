"""The network with one hidden layer as a module of torch, an oracle of its derivatives."""

import torch
from torch import nn


def perceptron(n_in, hidden, activation="sigmoid"):
    """y = W2 f(W1 x + b1) + b2 in float64, f the sigmoid or tanh."""
    f = {"sigmoid": nn.Sigmoid, "tanh": nn.Tanh}[activation]
    return nn.Sequential(nn.Linear(n_in, hidden), f(), nn.Linear(hidden, 1)).double()


def outputs_and_jacobian(module, p, x):
    """Outputs (n,) of the module with the weights p for the inputs x (n, n_in), and their Jacobian (n, len(p))."""
    nn.utils.vector_to_parameters(torch.as_tensor(p), module.parameters())
    weights, x = dict(module.named_parameters()), torch.as_tensor(x)
    found = torch.func.jacrev(lambda w: torch.func.functional_call(module, w, (x,))[:, 0])(weights)
    return module(x)[:, 0].detach().numpy(), torch.cat([J.flatten(1) for J in found.values()], 1).detach().numpy()
