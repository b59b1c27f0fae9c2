"""Guards of every fit: a model that runs away is an error, not a result."""

import numpy as np
import plants
import pytest

from hystfmu import Dataset, InputError, fit
from hystfmu.data.signals import training
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.methods import prandtl_ishlinskii


def data():
    u = training(12, 1, 0.05)
    return Dataset.from_signal(u, plants.prandtl_ishlinskii(u), 1e-3, "run")


def gain(k):
    """Build a model that multiplies the input by k; its output overflows for a large one."""
    nodes = [Node("a", "scaling", {"n": 1}, {"gain": k}), Node("b", "scaling", {"n": 1}, {"gain": k})]
    made = Graph(nodes, [("a.y", "b.u")], [Input("u", ("a.u",))], [Output("y", "b.y")])
    return lambda *arguments: (made, 2)


@pytest.mark.parametrize(
    ("k", "words"), [(9.0, r"Got an error of \d+ % of the span"), (1e200, "Got a run that diverges")]
)
def test_a_model_that_runs_away_is_refused(k, words, monkeypatch):
    monkeypatch.setattr(prandtl_ishlinskii, "build", gain(k))
    with pytest.raises(InputError, match=f"run: A model of the kind prandtl_ishlinskii must follow the data. {words}"):
        fit(data(), "prandtl_ishlinskii")


def test_the_mean_of_the_output_is_not_refused(monkeypatch):
    """The worst model that knows nothing: half the span for an output that switches between two values."""
    square = np.repeat([0.0, 1.0] * 20, 10)
    nodes = [Node("a", "scaling", {"n": 1}, {"gain": 0.0, "offset": 0.5})]
    made = Graph(nodes, [], [Input("u", ("a.u",))], [Output("y", "a.y")])
    monkeypatch.setattr(prandtl_ishlinskii, "build", lambda *arguments: (made, 1))
    model = fit(Dataset.from_signal(square + 0.1 * np.sin(np.arange(400)), square), "prandtl_ishlinskii")
    assert model.fit["rms_percent"] == 50
