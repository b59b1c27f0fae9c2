"""The network with one hidden layer as a module of torch, an oracle of its derivatives."""

from torch import nn


def perceptron(n_in, hidden, activation="sigmoid"):
    """y = W2 f(W1 x + b1) + b2 in float64, f the sigmoid or tanh."""
    f = {"sigmoid": nn.Sigmoid, "tanh": nn.Tanh}[activation]
    return nn.Sequential(nn.Linear(n_in, hidden), f(), nn.Linear(hidden, 1)).double()
