"""Files of labs at the first call: the record comes back, or one line says what to do; none is read wrong."""

import sys

import lab_files
import numpy as np
import pytest
from lab_files import KINDS, RATE, T, U, Y, drive, numbers, stamps, stroke, text

from hystfmu import InputError, read


def outcome(path, kind) -> str:
    """Whether a file is read right, wrong, or refused."""
    try:
        data = read(path)
    except InputError as e:
        return f"refused: {e}"
    if abs(data.h * RATE - 1) > {"jittered stamps": 1e-3, "days of Excel": 1e-5}.get(kind, 1e-6):
        return f"wrong step {data.h}"
    if kind == "jittered stamps":
        faults = np.abs([data.u - drive(data.t), data.y - stroke(data.t)]).max()
        return "right" if faults < 0.2 else f"wrong by {faults}"
    if len(data.t) != len(U):
        return f"wrong length {len(data.t)}"
    even = np.abs(data.t - data.t[0] - np.arange(len(U)) * data.h).max() < 1e-9
    slack = 0.05 if kind == "1 % dropped rows" else 1e-9
    right = even and np.abs([data.u - U, data.y - Y]).max() < slack
    return "right" if right else "wrong"


@pytest.mark.some(4)
@pytest.mark.parametrize("kind", KINDS)
def test_a_file_is_read_at_the_first_call(kind, tmp_path):
    for package, kinds in (("h5py", "HDF5"), ("pyarrow", "parquet feather"), ("openpyxl", "xlsx"), ("nptdms", "TDMS")):
        if any(k in kind for k in kinds.split()):
            pytest.importorskip(package)
    path = lab_files.write(tmp_path, kind)
    assert outcome(path, kind) == "right"


def rows(head, t, form):
    return text(head, [numbers(t, form), numbers(U), numbers(Y)])


SCALES = {
    "ms, by the rate of the header": (rows(["# fs: 2 kHz", "t,u,y"], T * 1e3, "{:.1f}"), "in ms (by the 2000 Hz"),
    "rows, by the rate of the header": (
        rows(["# dt = 0.5 ms", "t,u,y"], T * RATE, "{:.0f}"),
        "in rows (by the 2000 Hz",
    ),
    "days of Excel": (rows(["t,u,y"], 46348.4 + T / 86400, "{:.11f}"), "in days (by its size)"),
    "interval of a scope": (rows(["in s,C1 in V,C2 in V"], T, "{:.6e}"), "by their order"),
    "clock behind a date": (
        text(["Datum;Uhrzeit;u;y"], [["22.11.26"] * len(U), stamps("%H:%M:%S,%f"), numbers(U), numbers(Y)], ";"),
        "as date and clock from 23:59:59,500000",
    ),
    "clock of America": (
        text(["t,u,y"], [stamps("%m/%d/%Y %I:%M:%S.%f %p"), numbers(U), numbers(Y)]),
        "as date and clock from 11/22/2026 11:59:59.500000 PM",
    ),
}


@pytest.mark.parametrize("name", SCALES)
def test_the_scale_of_the_time_is_found_and_said(name, tmp_path):
    content, said = SCALES[name]
    (tmp_path / "a.csv").write_bytes(content)
    assert outcome(tmp_path / "a.csv", name) == "right"
    assert said in read(tmp_path / "a.csv").read_as


@pytest.mark.parametrize(("kind", "said"), [
    ("1 % dropped rows", "resampled to 2000 Hz: 18 of 2000 samples were lost"),
    ("jittered stamps", "resampled to 2000 Hz: stamps off by up to 10 % of a step"),
    ("epoch in ms", "time 'timestamp' in ms since 1970 (by its size), from 2025-11-22 08:26:40 UTC"),
    ("npy", "output column 3, by their order"),
    ("LVM without x", "2000 Hz, as the file states"),
])  # fmt: skip
def test_what_was_assumed_is_said(kind, said, tmp_path):
    assert said in read(lab_files.write(tmp_path, kind)).read_as


def test_a_time_that_counts_rows_is_in_doubt(tmp_path):
    (tmp_path / "a.csv").write_bytes(rows(["t,u,y"], T * RATE, "{:.0f}"))
    assert "no unit of measure is stated; if it counts rows, state --rate" in read(tmp_path / "a.csv").read_as


@pytest.mark.parametrize("share", [0.94, 0.5])
def test_many_lost_samples_are_refused(share, tmp_path):
    kept = np.sort(np.random.default_rng(1).permutation(len(T))[: int(share * len(T))])
    (tmp_path / "a.csv").write_bytes(lab_files.plain(T[kept], U[kept], Y[kept]))
    with pytest.raises(InputError, match=r"equal steps.*--resample"):
        read(tmp_path / "a.csv")


@pytest.mark.parametrize("columns", [[T, U, Y], [U, Y, T]])
def test_data_frames_and_arrays_are_read(columns):
    pyarrow = pytest.importorskip("pyarrow")
    frame = dict(zip("tuy" if columns[0] is T else "uyt", columns, strict=True))
    for given in (frame, pyarrow.table(frame)):
        data = read(given)
        assert np.abs([data.t - T, data.u - U, data.y - Y]).max() < 1e-12
    start = np.datetime64("2026-11-22T10:15:00", "ns") + np.round(T * 1e9).astype("timedelta64[ns]")
    assert np.abs(read({**frame, "t": start}).t - T).max() < 1e-12
    for array in (np.column_stack([T, U, Y]), np.array([T, U, Y])):
        assert np.abs([read(array).t - T, read(array).u - U, read(array).y - Y]).max() < 1e-12


def test_frames_of_pandas_go_in_and_out():
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"u [V]": U, "y": Y}, index=pandas.to_datetime(np.round(T * 1e9).astype(np.int64)))
    for given in (frame, frame.tz_localize("Europe/Berlin"), frame.set_index(pandas.Index(T, name="t"))):
        data = read(given)
        assert data.unit_u == "V"
        assert np.abs([data.t - T, data.u - U, data.y - Y]).max() < 1e-12


def test_pickled_objects_are_refused(tmp_path):
    np.save(tmp_path / "a.npy", np.array([{}, 1.0], dtype=object), allow_pickle=True)
    with pytest.raises(InputError, match="allow_pickle=False"):
        read(tmp_path / "a.npy")


@pytest.mark.parametrize(
    ("kind", "package"), [("xlsx", "openpyxl"), ("parquet", "pyarrow"), ("feather", "pyarrow"), ("TDMS", "nptdms")]
)
def test_a_missing_package_is_named_with_the_line_that_installs_it(kind, package, tmp_path, monkeypatch):
    pytest.importorskip(package)
    path = lab_files.write(tmp_path, kind)
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(InputError, match=rf"needs {package}, .*: pip install 'hystfmu\[files\]'"):
        read(path)
