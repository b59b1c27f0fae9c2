"""Reading measured data: good files to the last bit, bad ones refused with one line: file, line, rule, value."""

import numpy as np
import pytest

from hystfmu import Dataset, InputError, read

N = 12
T = np.arange(N) / 8
U = np.sin(T)
Y = np.cos(T)


def write(path, rows, head="t,u,y"):
    path.write_text("\n".join([head, *rows]) + "\n")
    return path


def rows(t=T, u=U, y=Y, form="{!r},{!r},{!r}"):
    return [form.format(*(float(v) for v in r)) for r in zip(t, u, y, strict=True)]


def refused(path, *words, **options):
    with pytest.raises(InputError) as e:
        read(path, **options)
    text = str(e.value)
    assert "\n" not in text
    assert text.startswith(str(path))
    for w in words:
        assert w in text, text


def test_round_trip_keeps_every_bit(tmp_path):
    first = Dataset(T, U, Y, "x", train="3:9")
    first.to_csv(tmp_path / "a.csv")
    second = read(tmp_path / "a.csv", train="3:9")
    for key in "tuy":
        np.testing.assert_array_equal(getattr(second, key), getattr(first, key))
    assert (second.h, second.train, second.name, second.sha256) == (0.125, slice(3, 9), "a", first.sha256)


def test_round_trip_keeps_the_records(tmp_path):
    one = Dataset(T, U, Y, "x")
    both = Dataset.joined([one, Dataset(T + 8, U[::-1], Y)])  # the time goes on
    both.to_csv(tmp_path / "a.csv")
    again = read(tmp_path / "a.csv", record="record number")
    assert again.sha256 == both.sha256
    assert again.read_as.count("read a.csv") == 1


def test_columns_units_separators_and_order(tmp_path):
    path = write(tmp_path / "b.csv", rows(form="7;{2!r};{1!r};{0!r}"), "n;out [um];drive [V];time [s]")
    d = read(path, time="time", input="drive", output="out")
    np.testing.assert_array_equal(d.u, U)
    np.testing.assert_array_equal(d.y, Y)
    assert (d.unit_u, d.unit_y) == ("V", "um")
    path.write_text("\ufeff" + path.read_text().replace("\n", "\r\n").replace(";", "\t"), newline="")
    np.testing.assert_array_equal(read(path, time="time", input="drive", output="out").t, T)


def test_rate_replaces_the_time_column(tmp_path):
    path = write(tmp_path / "c.csv", rows(form="{1!r},{2!r}"), "u,y")
    assert read(path, rate=200.0).h == 0.005
    refused(path, "line 1", "columns must include a time. Got u, y instead.", "--rate")
    refused(path, "rate", "-3", rate=-3.0)


def test_a_file_without_output_can_be_predicted_but_not_fitted(tmp_path):
    from hystfmu.identify import fit

    d = read(write(tmp_path / "d.csv", rows(form="{0!r},{1!r}"), "t,u"), output=None)
    assert not d.has_output
    with pytest.raises(InputError, match="must have a measured output"):
        fit(d, "prandtl_ishlinskii")
    assert d.with_output(Y).has_output


def test_missing_file_and_column(tmp_path):
    refused(tmp_path / "none.csv", "No such file")
    refused(write(tmp_path / "e.csv", rows()), "columns must include 'volts'. Got t, u, y instead.", input="volts")
    refused(write(tmp_path / "f.csv", rows(), "t,u,u"), "The column 'u' must occur once", output="u", input="u")
    four = [f"{row},1.0" for row in rows()]
    refused(write(tmp_path / "g.csv", four[1:], four[0]), "must include a time. Got 4 columns without names")
    refused(write(tmp_path / "h.csv", [], ""), "must have data rows. Got none.")


@pytest.mark.parametrize(("cell", "words"), [
    ("abc", ("line 7: The 'u' column must hold numbers. Got 'abc' instead.",)),
    ("", ("line 7", "'u'", "must hold numbers", "Got ''")),
    ("nan", ("line 7", "'u'", "finite", "Got nan")),
    ("-inf", ("line 7", "'u'", "finite", "Got -inf")),
    ("1e999", ("line 7", "'u'", "finite", "inf")),
    ("1_0", ("line 7", "'u'", "must hold numbers")),
    ("1,5", ("line 7", "3 cells, as line 1. Got 4 cells", "decimal comma")),
])  # fmt: skip
def test_a_bad_cell_is_named_by_line_and_column(tmp_path, cell, words):
    lines = rows()
    lines[5] = f"{float(T[5])!r},{cell},1.0"
    refused(write(tmp_path / "i.csv", lines), *words)


@pytest.mark.parametrize("cell", ["abc", "nan", "0.1"])
def test_lines_are_counted_as_an_editor_counts_them(tmp_path, cell):
    lines = rows()
    lines[5] = f"{cell},1.0,1.0"
    path = write(tmp_path / "a.csv", ["", *lines[:3], "", *lines[3:]])
    assert path.read_text().split("\n")[9 - 1] == lines[5]
    refused(path, "a.csv: line 9: ", cell)


def test_decimal_commas_between_commas(tmp_path):
    refused(write(tmp_path / "k.csv", [r.replace(".", ",") for r in rows()]), "line 2", "6 cells", "decimal comma")


def test_units_in_brackets_and_a_time_that_is_none(tmp_path):
    d = read(write(tmp_path / "a.csv", rows(), "t (s),u (V),y (um)"))
    assert (d.unit_u, d.unit_y, d.h) == ("V", "um", 0.125)
    refused(
        write(tmp_path / "b.csv", rows(), "t [samples],u,y"),
        "'t' column must be a time in s, ms",
        "[samples]",
        "--rate",
    )
    assert read(write(tmp_path / "c.csv", rows(), "t [ms],u,y"), rate=8.0).h == 0.125


def test_a_separator_at_the_end_of_some_rows_is_named(tmp_path):
    lines = rows()
    lines[3] += ","
    refused(write(tmp_path / "a.csv", lines), "line 5", "Got 4 cells", "ends with ','")


def test_short_rows_few_rows_no_rows_binary_and_size(tmp_path):
    lines = rows()
    lines[7] = "0.875,1.0"
    refused(write(tmp_path / "l.csv", lines), "line 9", "2 cells")
    refused(write(tmp_path / "m.csv", rows()[:3]), "at least 4 rows. Got 3 instead.")
    refused(write(tmp_path / "n.csv", []), "must have data rows")
    path = tmp_path / "o.csv"
    path.write_bytes(b"t,u,y\n\x00\x01,2\n")
    refused(path, "line 2", "must be text. Got the character 0x00")
    path.write_bytes(b"t,u,y\n\x81\xfe,2\n")
    refused(path, "line 2", "UTF-8, UTF-16, cp1252 or cp932. Got the byte 0x81: save the file as UTF-8")
    refused(write(tmp_path / "p.csv", rows()), "at most 100 bytes", most=100)


def test_time_must_increase(tmp_path):
    t = T.copy()
    t[6] = t[5]
    refused(write(tmp_path / "q.csv", rows(t)), "line 8", "increase", "0.625")


def test_a_missing_sample_is_found_at_its_line(tmp_path):
    keep = np.arange(N) != 6
    refused(write(tmp_path / "r.csv", rows(T[keep], U[keep], Y[keep])), "line 8", "equal steps", "0.25")
    # printed with digits that resolve the step, a missing sample still shows
    path = write(tmp_path / "s.csv", rows(T[keep], U[keep], Y[keep], "{:.2f},{:.3f},{:.3f}"))
    refused(path, "line 8", "equal steps")


def test_printed_digits_are_rounding_not_jitter(tmp_path):
    t = np.arange(200) / 60
    path = write(tmp_path / "t.csv", rows(t, np.sin(t), np.cos(t), "{:.4f},{:.6f},{:.6f}"))
    d = read(path)
    assert abs(d.h - 1 / 60) < 1e-6
    assert np.ptp(np.diff(d.t)) < 1e-12, "the rounded times are put back on the grid"


def test_jitter_is_refused_and_accumulated_rounding_is_not(tmp_path):
    jitter = T.copy()
    jitter[4] += 1e-5
    with pytest.raises(InputError, match="row 4"):
        Dataset(jitter, U, Y)
    t = np.add.accumulate(np.full(100_000, 1e-3))  # t += h, as loggers do
    assert abs(Dataset(t, t, t).h - 1e-3) < 1e-14


@pytest.mark.parametrize("train", ["0:13", "5:5", "9:5", "x:y", "3", (-1, 5), slice(0, 10, 2), "2:4"])
def test_train_rows_outside_the_data(tmp_path, train):
    refused(write(tmp_path / "u.csv", rows()), "The training rows must", "Got", train=train)


def test_train_rows_with_open_ends():
    d = Dataset(T, U, Y)
    assert d.train == slice(0, N)
    assert d.with_train("4:").train == slice(4, N)
    assert d.with_train(":6").train == slice(0, 6)
    assert d.with_train((1, 8)).span == np.ptp(Y[1:8])


def test_lengths_and_shapes():
    with pytest.raises(InputError, match="equal lengths"):
        Dataset(T, U[1:], Y)
    with pytest.raises(InputError, match="one-dimensional"):
        Dataset(T, U[:, None], Y)


def test_a_dataset_does_not_change_under_a_model():
    u = U.copy()
    d = Dataset(T, u, Y)
    u[0] = 9
    assert d.u[0] == U[0]
    with pytest.raises(ValueError, match="read-only"):
        d.u[0] = 9


def test_rows_of_a_file_are_named_by_the_lines_of_an_editor(tmp_path):
    lines = ["t,u,y", "0,0,0", "1,1,1", "", "2,2,1", "  ", "3,1,0", "4,0,0", ""]
    path = tmp_path / "gaps.csv"
    path.write_text("\n".join(lines))
    data = read(path)
    for row in range(5):
        line = int(data.place(row).rpartition(" ")[2])
        assert lines[line - 1].startswith(f"{row},")
    assert data.with_train("0:4").with_output(data.u).place(4) == f"{path}: line 8"
    assert read(path, resample=1.0).place(4) == f"{path}: row 4"  # rows of no file
    assert Dataset(data.t, data.u, data.y).place(4) == "data: row 4"
