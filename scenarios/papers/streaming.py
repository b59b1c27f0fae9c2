"""Online adaptation of a `polynomial_narx` model with every new sample."""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Input, Output
from hystfmu.identify.methods.polynomial_narx import basis
from hystfmu.model import Model
from hystfmu.unit import Unit
from papers.recursive import Recursive


class Stream:
    """Model whose weights are updated by recursive least squares with every new sample.

    >>> stream = Stream(model, mu=0.999)
    >>> for u, y in samples: stream.update(u, y)
    >>> stream.model.save("updated.model.toml")

    Parameters
    ----------
    model : Model
        Fitted model of the kind ``polynomial_narx``.
    eta : float
        Initial covariance P(0) = eta I. With a large eta, the first samples can change the weights much, which is
        suitable for a changed plant.
    mu : float
        Forgetting factor in (0, 1].
    dead_zone : float, optional
        Largest prediction error that changes no weight, in the unit of measure of y. By default, every error changes
        the weights.

    Raises
    ------
    InputError
        The model is of another kind, or a value is invalid for `Recursive`.
    """

    def __init__(self, model: Model, eta: float = 1.0, mu: float = 1.0, dead_zone: float | None = None) -> None:
        if [n.type for n in model.graph.nodes] != ["scaling", "zhao_tan", "polynomial_narx", "scaling"]:
            raise InputError(f"A model to update by samples must be a polynomial_narx. Got {model.key} instead.")
        self._start = model
        *front, self._network, readout = model.graph.nodes
        ends = [Output("x", f"{front[0].name}.y"), Output("f", f"{front[1].name}.h")]
        wire = (f"{front[0].name}.y", f"{front[1].name}.x")
        self._unit = Unit(Graph(front, [wire], [Input("u", (f"{front[0].name}.u",))], ends))
        self._h = model.step if model.step is not None else 1.0
        self._half, self._middle = float(readout.value("gain")[0]), float(readout.value("offset")[0])
        dims = self._network.dims
        self._sizes, self._n_k, self._q = (dims["n_u"], dims["n_f"], dims["n_y"]), dims["n_k"], dims["q"]
        theta = self._network.value("theta")
        scaled = None if dead_zone is None else dead_zone / self._half
        self.recursive = Recursive(len(theta), eta, mu, scaled, theta=theta)
        self._lags: list[Array] = []

    def update(self, u: float, y: float) -> float:
        """Update the weights with the next sample.

        Parameters
        ----------
        u, y : float
            Input and measured output, in the units of measure of the training data.

        Returns
        -------
        float
            One-step prediction of y before the update, in the unit of measure of y.
        """
        scaled = (y - self._middle) / self._half
        if self._lags:
            self._unit.set("u", u)
            self._unit.do_step((self.recursive.samples - 1) * self._h, self._h)
        else:
            self._unit.initialize(u=u)
        x, f = self._unit.get("x"), self._unit.get("f")
        # the past values of x and f are those at rest, and those of y the initial value of the model
        if not self._lags:
            rested = (x, f, float(self._network.value("y0")[0]))
            self._lags = [np.full(n, v) for n, v in zip(self._sizes, rested, strict=True)]
        if self._n_k == 0:
            self._push(0, x)
            self._push(1, f)
        e = self.recursive.update(basis(np.concatenate(self._lags), self._q), scaled)
        if self._n_k == 1:
            self._push(0, x)
            self._push(1, f)
        self._push(2, scaled)
        return y - e * self._half

    def _push(self, i: int, now: float) -> None:
        self._lags[i] = np.append(now, self._lags[i])[: self._sizes[i]]

    @property
    def model(self) -> Model:
        """Model with the present weights."""
        m = self._start
        graph = m.graph.replace(self._network.with_values(theta=self.recursive.theta))
        provenance = {**m.provenance, "updated_samples": self.recursive.samples}
        return Model(m.key, graph, m.step, m.text, {}, provenance)
