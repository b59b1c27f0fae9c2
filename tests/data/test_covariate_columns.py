"""Covariates of a data set: from Python and from files, by name with their units of measure, kept by every verb."""

import numpy as np
import pytest

from hystfmu import Dataset, InputError, read

N = 30
T = np.arange(N) / 1000
U, Y = np.sin(T), np.cos(T)
WARM, LOAD = np.linspace(20, 50, N), np.cos(40 * T)


def data(**more):
    return Dataset(T, U, Y, covariates={"T [degC]": WARM, "load": LOAD}, **more)


def test_names_and_units_of_measure_come_from_the_labels():
    found = data()
    assert found.covariates.names == ("T", "load")
    assert found.covariates.units == ("degC", "")
    assert repr(found) == "Dataset('data', 30 rows, step 0.001 s, covariates T [degC], load)"
    np.testing.assert_array_equal(found.covariates.values, np.column_stack([WARM, LOAD]))
    assert found.covariates.ranges == {"T": [20.0, 50.0], "load": [float(LOAD.min()), float(LOAD.max())]}


@pytest.mark.parametrize(("covariates", "words"), [
    ({"1st": WARM}, "name of a covariate must be letters, digits .* Got '1st' instead"),
    ({"u": WARM}, "and differ from t, u, y, time. Got 'u' instead"),
    ({"T": WARM, "T [K]": WARM}, r"and differ from t, u, y, time, T. Got 'T \[K\]' instead"),
    ({"T": WARM[:5]}, r"The covariate 'T' must have 30 rows. Got shape \(5,\) instead"),
    ({"T": np.where(T[4] == T, np.nan, WARM)}, "data: row 4: The covariate 'T' must be finite. Got nan instead"),
    ({"T": "warm"}, "The covariate 'T' must hold numbers. Got 'warm'"),
])  # fmt: skip
def test_a_bad_covariate_is_refused_in_one_line(covariates, words):
    with pytest.raises(InputError, match=words):
        Dataset(T, U, Y, covariates=covariates)


def test_every_verb_keeps_them():
    found = data()
    assert found.with_train("3:20").covariates is found.covariates
    assert found.with_output(-Y).covariates is found.covariates
    np.testing.assert_array_equal(found.aligned(2).covariates.values[:, 0], WARM[:-2])
    whole = Dataset.joined([found, found])
    np.testing.assert_array_equal(whole.covariates.values[:, 1], np.concatenate([LOAD, LOAD]))
    np.testing.assert_array_equal(whole.with_train("31:50").longest().covariates.values[:, 0], WARM)
    np.testing.assert_allclose(found.resampled(500.0).covariates.values[:, 0], WARM[::2], rtol=1e-12)
    assert found.sha256 != Dataset(T, U, Y).sha256
    with pytest.raises(InputError, match=r"must agree in covariates. Got none after T \[degC\], load of data"):
        Dataset.joined([found, Dataset(T, U, Y)])


def test_they_come_from_a_file_by_name_or_number(tmp_path):
    data().to_csv(tmp_path / "a.csv")
    for given in (("T", "load"), ("T [degC]", 5), (4, "5")):
        found = read(tmp_path / "a.csv", covariates=given)
        assert found.covariates.labels == ("T [degC]", "load")
        np.testing.assert_array_equal(found.covariates.values, data().covariates.values)
        np.testing.assert_array_equal(found.y, Y)
    assert read(tmp_path / "a.csv", "t", covariates=["load"]).covariates.names == ("load",)
    assert "covariate 'T [degC]', covariate 'load'" in found.read_as


def test_a_heading_becomes_an_identifier(tmp_path):
    rows = [f"{t!r};{u!r};{y!r};{w!r}" for t, u, y, w in zip(*(c.tolist() for c in (T, U, Y, WARM)), strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(["t;u;y;Temp. Ofen [°C]", *rows]))
    found = read(tmp_path / "a.csv", covariates=["Temp. Ofen"])
    assert found.covariates.labels == ("Temp_Ofen [degC]",)
    assert found.read_as.endswith("covariate 'Temp. Ofen [°C]' as Temp_Ofen")
    assert read(tmp_path / "a.csv", covariates=["Temp_Ofen"]).covariates.labels == found.covariates.labels
    with pytest.raises(InputError, match=r"must include 'oven'. Got .* --output, --covariate, or number them"):
        read(tmp_path / "a.csv", covariates=["oven"])
    for given, name in (([4, "Temp. Ofen"], "Temp. Ofen"), (["u"], "u")):
        with pytest.raises(InputError, match=f"must be a column of its own. Got '{name}', which has another role"):
            read(tmp_path / "a.csv", input="u", covariates=given)
