"""Check of a device by a new record: which part moved, from changes that are made on purpose."""

import json
from pathlib import Path

import numpy as np
import plants
import pytest
from click.testing import CliRunner
from invoked import invoked

import hystfmu as hy
from hystfmu import Dataset, Graph, Input, InputError, Node, Output
from hystfmu.base.arrays import Array
from hystfmu.cli import main
from hystfmu.data.signals import nested_reversals, training
from hystfmu.identify.device_check import check_device
from hystfmu.model import Model

H = 1e-3
NOISE = 2e-3


def noisy(y: Array, seed: int) -> Array:
    return y + NOISE * np.ptp(y) * np.random.default_rng(seed).normal(size=len(y))


def new(change: str = "") -> hy.Dataset:
    u = 0.9 * nested_reversals(30, 8, 0.02)
    y = plants.prandtl_ishlinskii(u)
    if change == "lag":
        y = np.concatenate([np.full(4, y[0]), y[:-4]])
    elif change == "loop":
        y = 2 * y - 1.5 * u
    y = noisy(y, 4)
    return hy.Dataset.from_signal(u, y * (1.1 if change == "gain" else 1) + 0.2 * (change == "offset"), H, "new")


@pytest.fixture(scope="module")
def model() -> hy.Model:
    u = training(30, 1, 0.02)
    data = hy.Dataset.from_signal(u, noisy(plants.prandtl_ishlinskii(u), 1), H, "first").with_train(":900")
    return hy.fit(data, "prandtl_ishlinskii", N=20)


def test_the_same_device_has_not_drifted(model: hy.Model) -> None:
    found = model.check(new())
    assert (found.drifted, found.moved, found.of) == (False, "", "held-out")
    assert found.rms == pytest.approx(model.score(new())["rms"], rel=1e-12)
    assert found.stated == model.fit["held_out_rms"]
    assert found.inside == 100
    lo, hi = model.provenance["trained_u"]
    assert found.reached == pytest.approx(100 * np.ptp(new().u) / (hi - lo))


@pytest.mark.parametrize(
    ("change", "value", "off"), [("offset", 0.2, 0.01), ("gain", 1.1, 0.005), ("lag", 4, 0), ("loop", 11, 0)]
)
def test_the_part_that_moved_is_named(model: hy.Model, change: str, value: float, off: float) -> None:
    found = model.check(new(change))
    assert found.drifted
    assert found.moved == change
    part = next(p for p in found.parts if p.name == change)
    assert float(part.value.split()[0]) == pytest.approx(value, abs=off)
    assert part.left <= 3 * NOISE * np.ptp(new(change).y)


def test_rows_outside_the_trained_range_do_not_count(model: hy.Model) -> None:
    u = np.concatenate([new().u, [1.5, 3.0, 1.0]])
    y = np.concatenate([new().y, [50.0, 60.0, 70.0]])
    found = model.check(hy.Dataset.from_signal(u, y, H, "further"))
    assert found.inside == pytest.approx(100 * (len(u) - 2) / len(u))
    with pytest.raises(hy.InputError, match=r"far: At least 52 rows .* trained range, [-\d.]+ to [\d.]+ V\. Got"):
        model.check(hy.Dataset(H * np.arange(100), np.linspace(2, 3, 100), np.linspace(2, 3, 100), "far", unit_u="V"))


def test_the_command_tells_it_by_its_status(model: hy.Model, tmp_path: Path) -> None:
    model.save(tmp_path / "m.model.toml")
    for change, status in (("", 0), ("gain", 1)):
        new(change).to_csv(tmp_path / "new.csv")
        done = invoked(["check", str(tmp_path / "m.model.toml"), str(tmp_path / "new.csv")], status=status)
        assert ("no drift" if status == 0 else "the gain moved most") in done.output
    done = CliRunner().invoke(main, ["check", str(tmp_path / "m.model.toml"), str(tmp_path / "new.csv"), "--json"])
    assert json.loads(done.output.splitlines()[-1])["moved"] == "gain"
    done = invoked(["check", str(tmp_path / "m.model.toml"), str(tmp_path / "new.csv"), "--factor", "1"], status=2)
    assert "factor of a check must be greater than 1" in done.output


def test_a_model_without_a_stated_error_is_refused() -> None:
    with pytest.raises(hy.InputError, match=r"must state its RMS error, fit\.rms > 0\. Got None of creep"):
        hy.Model.of_block(hy.blocks.Creep()).check(new())


# ---- by numbers ------------------------------------------------------------------------------------------------------
U = 3 + 2 * np.interp(np.arange(400), 10 * np.arange(41), np.random.default_rng(6).uniform(-1, 1, 41))


def gain(k=1.0, offset=0.0, name="u"):
    node = Node("a", "scaling", {"n": 1}, {"gain": k, "offset": offset})
    return Graph([node], [], [Input(name, ("a.u",))], [Output("y", "a.y")])


def stated(**more):
    return Model("k", gain(2.0), H, "", {"rms": 0.1, **more.pop("fit", {})}, {"trained_u": [1.0, 5.0], **more})


def record(y=lambda u: 2 * u, u=U):
    return Dataset.from_signal(u, y(u), H, "new")


@pytest.mark.parametrize(("factor", "drifted"), [(1.99, True), (2.01, False)])
def test_the_error_may_grow_by_a_factor(factor, drifted):
    found = check_device(stated(), record(lambda u: 2 * u + 0.2), factor)
    assert found.drifted is drifted
    assert (found.rms, found.max, found.stated, found.of) == (pytest.approx(0.2), pytest.approx(0.2), 0.1, "training")
    assert found.moved == ("offset" if drifted else "")
    assert found.factor == factor
    inside = (U >= 1) & (U <= 5)
    assert found.inside == pytest.approx(100 * inside.mean())
    assert found.reached == pytest.approx(100 * np.ptp(U[inside]) / 4)
    assert check_device(stated(), record(lambda u: 2 * u)).factor == 2.0
    assert str(found).startswith("drifted: RMS 0.2, 2 times the training" if drifted else "no drift: RMS 0.2, 2 times")
    held = check_device(stated(fit={"held_out_rms": 0.4}), record(lambda u: 2 * u + 0.2))
    assert (held.stated, held.of, held.drifted) == (0.4, "held-out", False)


@pytest.mark.parametrize("share", [0.02, 0.3, 1.0])
def test_a_change_of_the_gain_that_a_small_record_hides(share):
    u = 3 + share * (U - 3)
    size, offset = 2 * np.std(u[(u >= 1) & (u <= 5)]), lambda v: 2 * v + 0.1
    if size < np.sqrt(3) * 0.1:
        with pytest.raises(InputError, match="new: The output of the model must move enough"):
            check_device(stated(), record(offset, u))
        assert check_device(stated(), record(lambda v: 2 * v + 0.3, u)).drifted
        return
    found = check_device(stated(), record(offset, u))
    assert found.hidden_gain == pytest.approx(100 * np.sqrt(3) * 0.1 / size)
    assert str(found).endswith(f"a gain change below {found.hidden_gain:.2g} % does not show")
    for change, drifted in ((0.9, False), (1.1, True)):
        scaled = record(
            lambda v, k=1 + change * found.hidden_gain / 100: 2 * (k * (v - np.mean(u)) + np.mean(u)) + 0.1, u
        )
        assert check_device(stated(), scaled).drifted is drifted


def test_each_change_is_solved_alone():
    rng = np.random.default_rng(2)
    y = 2 * U + 0.3 * rng.normal(size=400)
    parts = {p.name: p for p in check_device(stated(), record(lambda u: y)).parts}
    rows = np.flatnonzero((U >= 1) & (U <= 5))
    rows = rows[(rows >= 8) & (rows < 392)]
    out = 2 * U

    def rest(*columns):
        a = np.column_stack(columns)
        return np.sqrt(np.mean((y[rows] - a @ np.linalg.lstsq(a, y[rows], rcond=None)[0]) ** 2))

    ones = np.ones(len(rows))
    assert parts["offset"].left == pytest.approx(np.std(y[rows] - out[rows]))
    assert parts["offset"].value == f"{np.mean(y[rows] - out[rows]):+.4g}"
    assert parts["gain"].left == pytest.approx(rest(ones, out[rows]))
    late = {k: rest(ones, out[rows - k]) for k in range(-8, 9)}
    k = min(late, key=late.get)
    assert parts["lag"].left == pytest.approx(late[k])
    assert parts["lag"].value == f"{k:+d} rows ({k * H:+.3g} s)"
    assert parts["loop"].value == "11 further weights"
    assert parts["loop"].left < parts["gain"].left


def test_many_rows_are_thinned():
    u = 3 + 1.9 * np.sin(np.arange(9000) / 50)
    found = check_device(stated(), record(lambda v: 2 * v + 0.5 * (np.arange(len(v)) % 3 == 2), u))
    assert found.parts[0].value == "+0.5"  # every third row, from row 8 on: rows 8, 11, ...


@pytest.mark.parametrize("rms", [0.01, 0.1])
def test_the_first_part_within_a_quarter_of_the_best_or_of_the_fit(rms):
    """Gains from 2 on: an offset explains the smallest change, then a gain does."""
    noise, seen = 0.1 * np.random.default_rng(3).normal(size=400), []
    for gain in np.linspace(2, 2.3, 31):
        found = check_device(stated(fit={"rms": rms}), record(lambda u, gain=gain: gain * u + 3 + noise))
        left = {p.name: p.left for p in found.parts}
        assert list(left) == ["offset", "gain", "lag", "loop"]
        assert found.moved == next(k for k, v in left.items() if v <= 1.25 * max(min(left.values()), rms))
        seen.append(found.moved)
    assert seen == sorted(seen, reverse=True)
    assert {"offset", "gain"} <= set(seen)


@pytest.mark.parametrize(("given", "data", "factor", "words"), [
    (stated(), record(lambda u: np.full(len(u), np.nan)), 2.0, "new: The data must have a measured output"),
    (stated(), record(), 1.0, r"greater than 1\. Got 1 instead"),
    (stated(fit={"rms": 0.0}), record(), 2.0, r"fit\.rms > 0\. Got 0\.0 of k"),
    (stated(trained_u=None), record(), 2.0, r"trained_u = \[least, largest\]\. Got None"),
    (stated(trained_u=[1.0]), record(), 2.0, r"Got \[1\.0\]"),
])  # fmt: skip
def test_what_a_check_needs(given, data, factor, words):
    with pytest.raises(InputError, match=words):
        check_device(given, data, factor)


@pytest.mark.parametrize(("rows", "enough"), [(52, True), (51, False)])
def test_four_rows_a_weight_inside_the_trained_range(rows, enough):
    u = np.full(400, 9.0)
    u[100 : 100 + rows] = np.linspace(1.0, 5.0, rows)
    if enough:
        assert check_device(stated(), record(u=u)).inside == pytest.approx(100 * rows / 400)
    else:
        with pytest.raises(InputError, match=r"At least 52 rows .* range, 1 to 5\. Got 51 rows"):
            check_device(stated(), record(u=u))
    older = Model("k", gain(2.0), H, "", {"rms": 0.1}, {"span_u": [1.0, 5.0]})
    assert check_device(older, record()).stated == 0.1
