"""Wrong calls of the face: one line that names the argument, its rule and what was given; never a raw exception."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hystfmu as hy

T = np.arange(40) / 1000.0
U, Y = np.sin(40 * T), np.sin(40 * T - 0.3)
FRAME = {"t": T, "u [V]": U, "y [um]": Y}


def model() -> Any:
    """A model of one block: no fit is needed."""
    return hy.Model.of_block(hy.blocks.PrandtlIshlinskii(w0=1.0, r=[0.1, 0.3], w=[0.5, 0.2]), step=1e-3)


def data() -> Any:
    return hy.Dataset(T, U, Y)


def loop() -> Any:
    return hy.Scenario("s", step=1e-3, stop=0.01).add("source", hy.blocks.Reference())


def started() -> Any:
    unit = model().unit()
    unit.initialize()
    return unit


H: Any = hy  # a type checker refuses these calls
CALLS: dict[str, Callable[[], object]] = {
    "read int": lambda: H.read(5),
    "read None": lambda: H.read(None),
    "read ints": lambda: H.read([1, 2]),
    "read nothing": lambda: H.read([]),
    "read name": lambda: H.read(FRAME, unit="ms"),
    "read rate": lambda: H.read(FRAME, rate="fast"),
    "read resample": lambda: H.read(FRAME, resample="x"),
    "read lag": lambda: H.read(FRAME, lag="x"),
    "read lag float": lambda: H.read(FRAME, lag=1.5),
    "read train": lambda: H.read(FRAME, train=5),
    "read train of three": lambda: H.read(FRAME, train=(1, 2, 3)),
    "read train of words": lambda: H.read(FRAME, train=("a", "b")),
    "read covariates": lambda: H.read(FRAME, covariates=3),
    "read most": lambda: H.read("a.csv", most="x"),
    "read decimal": lambda: H.read(FRAME, decimal=";"),
    "read words": lambda: H.read({"a": ["x", "y"]}),
    "read text": lambda: H.read("t,u,y\n0,1,2"),
    "read one row": lambda: H.read(np.zeros(5)),
    "read a cube": lambda: H.read(np.zeros((5, 3, 3))),
    "data of nothing": lambda: H.Dataset(),
    "data of two": lambda: H.Dataset(T, U),
    "data of None": lambda: H.Dataset(None, None, None),
    "data of words": lambda: H.Dataset("a.csv", "u", "y"),
    "data starts": lambda: H.Dataset(T, U, Y, starts=5),
    "data train": lambda: H.Dataset(T, U, Y, train=3.5),
    "data name": lambda: H.Dataset(T, U, Y, name=5),
    "data covariates": lambda: H.Dataset(T, U, Y, covariates=[1]),
    "data unit": lambda: H.Dataset(T, U, Y, unit_u=1),
    "with_train": lambda: data().with_train(5),
    "resampled": lambda: data().resampled("x"),
    "aligned": lambda: data().aligned("x"),
    "joined": lambda: H.Dataset.joined(data()),
    "joined ints": lambda: H.Dataset.joined([1]),
    "from_signal": lambda: H.Dataset.from_signal(5, 6),
    "to_csv": lambda: data().to_csv(None),
    "fit list": lambda: H.fit([1, 2, 3]),
    "fit arrays": lambda: H.fit(T, U, Y),
    "fit path": lambda: H.fit("piezo.csv"),
    "fit None": lambda: H.fit(None),
    "fit model": lambda: H.fit(model()),
    "fit swapped": lambda: H.fit("preisach", data()),
    "fit misspelt": lambda: H.fit(data(), "prandl"),
    "fit number": lambda: H.fit(data(), 5),
    "fit named kind": lambda: H.fit(data(), model="preisach"),
    "fit option": lambda: H.fit(data(), "prandtl_ishlinskii", N="x"),
    "fit option list": lambda: H.fit(data(), "prandtl_ishlinskii", N=[1]),
    "fit free": lambda: H.fit(data(), hy.blocks.BoucWen(), free=5),
    "fit free list": lambda: H.fit(data(), hy.blocks.BoucWen(), free=["beta"]),
    "fit purpose": lambda: H.fit(data(), "prandtl_ishlinskii", purpose=3),
    "predict path": lambda: model().predict("piezo.csv"),
    "predict None": lambda: model().predict(None),
    "predict number": lambda: model().predict(5.0),
    "predict step": lambda: model().predict(U, "x"),
    "predict matrix": lambda: model().predict(np.zeros((4, 3))),
    "predict covariates": lambda: model().predict(U, covariates=[1]),
    "predict words": lambda: model().predict(["a", "b"]),
    "predict ragged": lambda: model().predict([[1], [1, 2]]),
    "predict data and step": lambda: model().predict(data(), 1e-3),
    "score array": lambda: model().score(U),
    "score None": lambda: model().score(None),
    "score path": lambda: model().score("piezo.csv"),
    "score rows": lambda: model().score(data(), rows=5),
    "score lengths": lambda: model().score(U, y=Y[:5]),
    "check": lambda: model().check(5),
    "plot": lambda: model().plot(5),
    "report": lambda: model().report(5, "a.html"),
    "inverse": lambda: model().inverse(5),
    "export None": lambda: model().export(None),
    "export fmi": lambda: model().export("a.fmu", fmi="x"),
    "save None": lambda: model().save(None),
    "load None": lambda: H.Model.load(None),
    "of_block": lambda: H.Model.of_block(5),
    "model of a number": lambda: H.Model("x", 5, 1e-3),
    "unit of a model": lambda: H.Unit(model()),
    "unit of None": lambda: H.Unit(None),
    "unit set": lambda: model().unit().set("u", "x"),
    "unit get": lambda: model().unit().get(5),
    "unit initialize": lambda: model().unit().initialize("x"),
    "unit input": lambda: model().unit().initialize(q=1),
    "unit step": lambda: started().do_step("a", "b"),
    "unit tangent": lambda: started().tangent(0, "b"),
    "unit tangent of two": lambda: started().tangent(0, [1.0, 2.0]),
    "scenario name": lambda: H.Scenario(5, step=1e-3),
    "scenario step": lambda: H.Scenario("a", step="x"),
    "scenario without step": lambda: H.Scenario("a"),
    "add a number": lambda: loop().add("p", 5),
    "add by number": lambda: loop().add(5, model()),
    "connect": lambda: loop().connect(5, 6),
    "metric limit": lambda: loop().metric("m", "peak", "source.r", limit="x").run(),
    "case": lambda: loop().case("a", set=5),
    "run a number": lambda: H.run(5),
    "run None": lambda: H.run(None),
    "run model": lambda: H.run(model()),
    "study None": lambda: H.study(None),
    "validate None": lambda: H.validate(None),
    "block of words": lambda: H.blocks.Pid(Kp="x"),
    "block of another": lambda: H.blocks.Pid(kp=1.0),
    "block on words": lambda: H.blocks.Creep()("x"),
    "node": lambda: H.Node("a", "pidd"),
    "graph": lambda: H.Graph([5], (), [], []),
    "synthetic": lambda: H.synthetic.piezo("x"),
}  # fmt: skip


@pytest.mark.parametrize("name", CALLS)
def test_a_wrong_call_is_refused_in_one_line(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(hy.InputError) as e:
        CALLS[name]()
    message = str(e.value)
    assert "\n" not in message
    assert len(message) > 20


def test_the_line_names_argument_rule_and_remedy() -> None:
    with pytest.raises(hy.InputError) as e:
        H.fit([1, 2, 3])
    assert "hy.read(path) and hy.Dataset(t, u, y) make a Dataset" in str(e.value)
    with pytest.raises(hy.InputError) as e:
        H.read(FRAME, lag="x")
    assert str(e.value) == "The 'lag' argument of read() must be an int. Got 'x' instead."
    with pytest.raises(hy.InputError, match=r"Got: got an unexpected keyword argument 'rates'. Did you mean 'rate'"):
        H.read(FRAME, rates=5.0)
    with pytest.raises(hy.InputError, match="must be the second argument"):
        H.fit(data(), model="preisach")
    with pytest.raises(hy.InputError, match=r"a Graph. Got a Model instead. The graph of a model is model.graph"):
        H.Unit(model())


def test_predict_and_score_take_the_same_things() -> None:
    made, wanted = model(), model().predict(U, 1e-3)
    pyarrow = pytest.importorskip("pyarrow")
    for given in (data(), FRAME, pyarrow.table(FRAME), U, U.tolist()):
        np.testing.assert_array_equal(made.predict(given), wanted)
    scores = [made.score(given) for given in (data(), FRAME, pyarrow.table(FRAME))]
    scores += [made.score(u, y=Y, h=1e-3) for u in (U, U.tolist())]
    assert all(s == scores[0] for s in scores)
    assert scores[0]["max"] == np.abs(wanted - Y).max()


def test_data_go_to_pandas_and_back() -> None:
    pytest.importorskip("pandas")
    given = hy.Dataset(T, U, Y, unit_u="V", unit_y="um", covariates={"T [degC]": 20 + T})
    frame = given.to_pandas()
    assert list(frame.columns) == ["u [V]", "y [um]", "T [degC]"]
    assert hy.read(frame, covariates=["T"]).sha256 == given.sha256
    np.testing.assert_array_equal(model().predict(frame[["u [V]", "y [um]"]]), model().predict(U))
