"""Several records in one fit: each runs from a fresh start of its own, from files, a record column or Python."""

import json

import numpy as np
import plants
import pytest
from invoked import invoked

from hystfmu import Dataset, InputError, Model, fit, read
from hystfmu.data.signals import training
from hystfmu.identify.catalogue import METHODS, method
from hystfmu.identify.cuts import one_run

H = 1e-3
KINDS = [
    key for key in METHODS if key != "auto" and method(key).records and "oscillator" not in key
]  # plays have no mass
CHEAP = {"play_bank_mlp": {"iterations": 20, "starts": 1, "hidden": 2}, "preisach": {"n": 6, "widths": 4, "means": 2}}


def record(seed, first=0.0):
    """A run from rest: the plays of the plant start at 0."""
    u = np.concatenate([[0.0], np.linspace(0, first, 12)[1:], training(12, seed, 0.05)])
    return Dataset.from_signal(u, plants.prandtl_ishlinskii(u), H, f"run_{seed}")


@pytest.fixture(scope="module")
def parts():
    return [record(1), record(2, 0.9), record(3, -0.7)]


@pytest.mark.turn("records of a fit")
def test_a_fit_to_several_records_forgets_between_them(parts):
    data = Dataset.joined(parts)
    model = fit(data, "prandtl_ishlinskii", N=40)
    free = np.concatenate([model.predict(part.u, H) for part in parts])
    assert model.fit["rms"] == pytest.approx(float(np.sqrt(np.mean((free - data.y) ** 2))), rel=1e-12)
    assert model.fit["rms_percent"] < 0.3
    one = Dataset(np.arange(len(data.u)) * H, data.u, data.y)  # as if the memory went on
    assert fit(one, "prandtl_ishlinskii", N=40).fit["rms_percent"] > 4 * model.fit["rms_percent"]
    assert model.provenance["starts"] == list(data.starts)


@pytest.mark.turn("records of a fit")
@pytest.mark.some(1)
@pytest.mark.parametrize("key", KINDS)
def test_every_kind_that_takes_records_runs_each_from_a_fresh_start(key, parts):
    data = Dataset.joined(parts)
    model = fit(data, key, **CHEAP.get(key, {}))
    free = np.concatenate([model.predict(part.u, H) for part in parts])
    assert model.fit["rms"] == pytest.approx(float(np.sqrt(np.mean((free - data.y) ** 2))), rel=1e-9)
    assert model.fit["rms_percent"] < 4


@pytest.mark.turn("records of a fit")
@pytest.mark.some(1)
@pytest.mark.parametrize("key", ["g0_prandtl_ishlinskii", pytest.param("actuator", marks=pytest.mark.stress)])
def test_kinds_that_take_one_record_are_led_back_to_rest_between_several(key, parts):
    model = fit(Dataset.joined(parts), key)
    free = np.concatenate([model.predict(part.u, H) for part in parts])
    y = np.concatenate([part.y for part in parts])
    assert model.fit["rms"] == pytest.approx(float(np.sqrt(np.mean((free - y) ** 2))), rel=1e-9)
    assert model.fit["rms_percent"] < 0.15


def test_the_way_between_two_records_leads_back_to_rest(parts):
    held = np.zeros(sum(len(p.u) for p in parts), dtype=bool)
    held[5] = True
    data = Dataset.joined(parts).with_held(held)
    run = one_run(data)
    assert len(run.starts) == 1
    np.testing.assert_array_equal(run.y[run.counted], data.y[data.counted])
    np.testing.assert_array_equal(run.u[run.counted], data.u[data.counted])
    assert run.u.min() == data.u.min()
    assert run.u.max() == data.u.max()
    state = plants.prandtl_ishlinskii(run.u)  # the plant itself, not at rest between the records
    np.testing.assert_allclose(state[run.counted], data.y[data.counted], atol=0.01 * data.span)
    assert one_run(parts[0]) is parts[0]


def test_a_record_that_begins_at_an_end_of_the_range_counts_from_its_first_full_swing():
    parts = [Dataset.from_signal(p.u + 1, p.y, H) for p in (record(1), record(2))]
    low = [
        Dataset.from_signal(np.concatenate([np.linspace(0, p.u[0], 9), p.u]), np.r_[np.zeros(9), p.y], H) for p in parts
    ]
    run = one_run(Dataset.joined(low))
    counted = run.u[run.counted]
    assert run.u.min() == 0
    second = counted[len(low[0].u) :]
    assert len(second) < len(low[1].u)
    assert second[0] >= 0.9 * run.u.max()


@pytest.mark.turn("records of a fit")
def test_records_from_files_and_from_a_column(tmp_path, parts):
    names = []
    for k, part in enumerate(parts):
        names.append(str(tmp_path / f"run{k}.csv"))
        part.to_csv(names[-1])
    data = read(names)
    lines = [f"{name};{t!r};{u!r};{y!r}" for name, part in zip("aba", parts, strict=True)
             for t, u, y in zip(part.t.tolist(), part.u.tolist(), part.y.tolist(), strict=True)]  # fmt: skip
    (tmp_path / "all.csv").write_text("\n".join(["run;t;u;y", *lines]))
    column = read(tmp_path / "all.csv", record="run")
    for found in (data, column):
        assert found.starts == Dataset.joined(parts).starts
        assert found.h == pytest.approx(H)
        np.testing.assert_array_equal(found.u, np.concatenate([part.u for part in parts]))
        assert "3 records" in repr(found)
    assert "records by 'run'" in column.read_as
    out = str(tmp_path / "m.model.toml")
    done = invoked(["fit", *names, "--model", "prandtl_ishlinskii", "-o", out, "--json"])
    assert json.loads(done.stdout)["rms_percent"] == Model.load(out).fit["rms_percent"] < 1


def test_records_that_do_not_belong_together(tmp_path, parts):
    with pytest.raises(InputError, match=r"must have one step. Got 0.002 s in record 2 after 0.001 s"):
        Dataset.joined([parts[0], Dataset.from_signal(parts[1].u, parts[1].y, 2 * H)])
    with pytest.raises(InputError, match=r"must agree in unit_u. Got 'V' after ''"):
        Dataset.joined([parts[0], Dataset(parts[1].t, parts[1].u, parts[1].y, unit_u="V")])
    with pytest.raises(InputError, match="at least 4 apart"):
        Dataset(parts[0].t, parts[0].u, parts[0].y, starts=[0, 2])
    path = tmp_path / "short.csv"
    path.write_text("\n".join(["run,t,u,y", *(f"{int(k == 5)},{k},{k},{k}" for k in range(9))]))
    with pytest.raises(InputError, match=r"short.csv: line 7: A record must have at least 4 rows. Got 1 in record 2"):
        read(path, record="run")
