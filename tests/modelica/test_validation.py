"""Every Validation and Example model against the C core and the committed references."""

import compare
import compare_operator
import library
import numpy as np
import outcome
import pytest
import simulate
import validation_signal

OPERATORS = [n for n in compare.models() if compare_operator.is_realisation(n, "Validation")]


# Of the realisations Events and Smooth two operators run here and all of them in `make stress` and `make modelica`; the
# others of this list take 0.7 s and more each.
QUICK = ("PlayBank", "BoucWen")
LONG = (
    "Sampled.BoucWenKnee", "Sampled.DuhemSteps", "Sampled.ConstraintFactorInverse", "Sampled.ImplicitInverse",
    "Sampled.JilesAtherton",
)  # fmt: skip


def is_long(name: str) -> bool:
    kind, _, block = name.removeprefix("HystFMU.Validation.").partition(".")
    return f"{kind}.{block}" in LONG or (kind in ("Events", "Smooth") and block not in QUICK)


MODELS = [pytest.param(n, marks=pytest.mark.stress) if is_long(n) else n for n in compare.models()]


@pytest.mark.some(3)
@pytest.mark.parametrize("name", MODELS)
def test_model_agrees(name: str) -> None:
    o = compare.compare(name)
    print(outcome.line(o))
    assert o.bad == []


def test_every_operator_has_every_signal_in_every_realisation() -> None:
    """The one signal of these models holds them all; every realisation of every operator is validated on it."""
    for name in OPERATORS:
        model = library.classes()[name]
        assert str(model.tree.symbols["signal"].type) == "BaseClasses.TestSignal", name
        assert library.experiment(model)["StopTime"] == 1.4, name
        # nothing between the signal and the input
        of = library.find(str(model.tree.symbols["tested"].type), name)
        assert of is not None
        (port,) = (
            p for p in library.ports(of, "RealInput") if p[0] != "d" or p[1:] not in library.ports(of, "RealInput")
        )
        assert f"connect(signal.r, tested.{port}) " in library.text(model.file), name
    for package in ("Operators", "Inverse"):
        blocks = [n for n in library.classes() if compare_operator.is_realisation(n, package)]
        assert blocks
        for name in blocks:
            kind, short_name = name.split(".")[2:]
            assert f"HystFMU.Validation.{kind}.{short_name}" in OPERATORS


def test_the_simulated_signal_is_the_one_of_numpy() -> None:
    rows = simulate.run("HystFMU.Validation.Events.PlayBank").instants()
    assert np.abs(rows["signal.r"] - validation_signal.signal_form(rows["time"])).max() < 1e-9
