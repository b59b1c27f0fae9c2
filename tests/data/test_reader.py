"""Files as labs write them: read to the truth with units of measure, or refused with the remedy in one line."""

import gzip
import io
import re
import subprocess
import sys
import zipfile

import lab_files
import numpy as np
import pytest
from scipy.io import savemat

from hystfmu import InputError, fit, read

N = 40
T = np.arange(N) / 2000
U = np.round(60 * np.sin(400 * T) + 0.125, 4)
Y = np.round(9 * np.cos(370 * T) - 0.5, 4)


def lines(separator=";", comma=False, factor=1000.0, form="{:.4f}", end="", columns=(T, U, Y), edge=""):
    """Rows of text: time times a factor, input, output."""
    made = []
    for t, *others in zip(*columns, strict=True):
        cells = [f"{t * factor:.6g}", *(form.format(v) for v in others)]
        cells = [c.replace(".", ",") if comma else c for c in cells]
        made.append(edge + separator.join(cells) + end)
    return made


def text(head, rows, encoding="utf-8", newline="\n", tail="\n"):
    return (newline.join([*head, *rows]) + tail.replace("\n", newline)).encode(encoding)


GERMAN = ["Zeit [ms];Spannung [V];Weg [µm]"]
PREAMBLE = ["Messung;Piezo 3", "Datum;22.11.2026", "Abtastrate;2000", ""]
LABVIEW = [
    "LabVIEW Measurement\t", "Writer_Version\t2", "Separator\tTab", "Decimal_Separator\t,", "***End_of_Header***\t",
    "Channels\t2\t\t", "Samples\t40\t40\t", "***End_of_Header***\t\t\t", "X_Value\tSpannung [V]\tWeg [um]\tComment",
]  # fmt: skip


def quoted(row):
    return ",".join(f'"{c}"' for c in row.split(";"))


def mat(**arrays):
    out = io.BytesIO()
    compressed = arrays.pop("compressed", False)
    savemat(out, arrays, do_compression=compressed)
    return out.getvalue()


def changed(content, at, byte):
    return content[:at] + bytes([byte]) + content[at + 1 :]


def hdf5(fill, **options):
    h5py = pytest.importorskip("h5py")
    out = io.BytesIO()
    with h5py.File(out, "w", **options) as file:
        fill(file)
    return out.getvalue()


def mat_7_3():
    """As MATLAB writes it: a block with the header of a MAT file, then HDF5; columns first."""
    content = hdf5(as_matlab_7_3, userblock_size=512)
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    return head + content[len(head) :]


def in_group(file):
    for name, column, unit in (("t", T * 1e3, "ms"), ("u", U, "V"), ("y", Y, "µm")):
        file.create_dataset(f"run/{name}", data=column).attrs["units"] = unit
    file.create_dataset("run/fs", data=[2000.0])


def formulas():
    """As programs write workbooks that no spreadsheet has computed yet."""
    book, out = pytest.importorskip("openpyxl").Workbook(), io.BytesIO()
    for row in (("t [ms]", "u [V]", "y [um]"), *((k, k % 3, f"=B{k + 2}/2") for k in range(9))):
        book.active.append(row)
    book.save(out)
    return out.getvalue()


def later_channel():
    pytest.importorskip("nptdms")
    return lab_files.tdms(later=2)


def as_netcdf(file, missing=-1.0):
    """Packed: value * scale_factor + add_offset; some values may be missing."""
    for name, column, unit, scale, offset in (
        ("t", T * 1e3 + 4.0, "ms", 1.0, -4.0), ("u", 8.0 * U, "V", 0.125, 0.0), ("y", 2.0 * Y, "um", 0.5, 0.0)
    ):  # fmt: skip
        item = file.create_dataset(name, data=np.where(np.arange(N) == 4, missing, column) if missing > 0 else column)
        for key, value in (("scale_factor", scale), ("add_offset", offset), ("_FillValue", [1e9])):
            item.attrs[key] = value
        item.attrs["units"] = unit
    file.create_dataset("fs", data=1000.0).attrs["scale_factor"] = 2.0


def with_step_of_a_group(file):
    """No time; a text stands between the channels; the names of the channels are those of their groups."""
    rig = file.create_group("rig")
    rig.attrs["sample rate"] = 2000.0
    for name, column, unit in (("Drive", U, "V"), ("Note", None, ""), ("Travel", Y, "µm")):
        where = rig.create_group(name)
        item = where.create_dataset("data", data="warm" if column is None else column)
        item.attrs["units"] = unit


def with_two_rates(file):
    """Two groups whose channels have other time steps, as those of two tasks of one instrument."""
    for group, step in (("fast", 1e-4), ("slow", 5e-4)):
        for name, column, unit in (("u", U, "V"), ("y", Y, "um")):
            item = file.create_dataset(f"{group}/{name}", data=column)
            item.attrs["units"] = unit
            item.attrs["dt"] = step


def as_matlab_7_3(file):
    for name, column in (("time_ms", T * 1e3), ("u", U), ("y", Y)):
        file.create_dataset(name, data=column[None])


# name of the file, its bytes, options; the answer is the same for all: T, U in V, Y in um
VARIANTS = {
    "plain": ("a.csv", text(["t,u [V],y [um]"], lines(",", factor=1.0)), {}),
    "byte order mark, CRLF": ("a.csv", text(["t [s],u [V],y [um]"], lines(",", factor=1.0), "utf-8-sig", "\r\n"), {}),
    "line ends of an old Mac": ("a.csv", text(["t,u [V],y [um]"], lines(",", factor=1.0), newline="\r"), {}),
    "full-width brackets": ("a.csv", text(["時間（ms）,電圧［V］,変位（µm）"], lines(",")), {}),
    "German Excel": ("a.csv", text(GERMAN, lines(comma=True), "cp1252", "\r\n"), {}),
    "German Excel, named": (
        "a.csv",
        text(GERMAN, lines(comma=True), "cp1252", "\r\n"),
        {"time": "Zeit [ms]", "input": "Spannung", "output": "Weg [µm]"},
    ),
    "UTF-16 of Excel": ("a.txt", text([GERMAN[0].replace(";", "\t")], lines("\t", comma=True), "utf-16"), {}),
    "UTF-16 without mark": ("a.txt", text(["t/ms\tu/V\ty/um"], lines("\t"), "utf-16-le"), {}),
    "UTF-16, big end first": ("a.txt", b"\xfe\xff" + text(["t/ms;u/V;y/um"], lines(), "utf-16-be"), {}),
    "micro sign of Greek": ("a.csv", text(["t (us);u (V);y (μm)"], lines(factor=1e6)), {}),
    "preamble": ("a.csv", text([*PREAMBLE, *GERMAN], lines(comma=True)), {}),
    "sep= of Excel": ("a.csv", text(["sep=;", *GERMAN], lines()), {}),
    "line of units": ("a.csv", text(["time;input;output", "ms;V;µm"], lines()), {}),
    "line of units in brackets": ("a.csv", text(["Time,Drive,Response", "(ms),(V),(um)", ""], lines(",")), {}),
    "LabVIEW": ("a.lvm", text(LABVIEW, lines("\t", comma=True, factor=1.0)), {}),
    "numpy.savetxt": ("a.txt", text(["# t u_V y_um"], lines(" ", factor=1.0, form="{:.18e}")), {}),
    "comments of MATLAB": ("a.dat", text(["% piezo stack", "% time_ms, u [V], y [um]"], lines(", ")), {}),
    "comments between rows": (
        "a.csv",
        text(["# rig 2", "t [ms],u [V],y [um]"], [*lines(",")[:7], "# pause", "", *lines(",")[7:]]),
        {},
    ),
    "aligned blanks": ("a.txt",
        text(["  time (ms)   Voltage (V)   Displacement (um)"], lines("     ", form="{:9.4f}", edge="   ", end="  ")),
        {}),
    "blanks and decimal comma": ("a.txt", text(["t/ms  u/V  y/um"], lines("  ", comma=True)), {}),
    "quotes": ("a.csv", text(['"t [ms]","u [V]","y [um]"'], map(quoted, lines())), {}),
    "quotes and decimal comma": ("a.csv", text([quoted(GERMAN[0])], [quoted(r) for r in lines(comma=True)]), {}),
    "quoted name with a separator": ("a.csv", text(['"time, ms";"drive; u [V]";"y [um]"'], lines()),
        {"input": "drive; u"}),
    "separator at the end": ("a.csv", text(["t [ms];u [V];y [um];"], lines(end=";")), {}),
    "separator at the end of rows": ("a.csv", text(["t [ms];u [V];y [um]"], lines(end=";")), {}),
    "blank behind separators": ("a.csv", text(["t [ms]; u [V]; y [um]"], lines("; ")), {}),
    "thousands": ("a.csv",
        text(["t [us];u [V];y [um]"], [r.replace(".", ",").replace("1000;", "1.000;") for r in lines(factor=1e6)]), {}),
    "decimal sign said": ("a.csv", text(["t [ms];u [V];y [um]"], lines(comma=True)), {"decimal": ","}),
    "minutes": ("a.csv", text(["t [min];u [V];y [um]"], [
        f"{t / 60:.17g};{u!r};{y!r}" for t, u, y in zip(T.tolist(), U.tolist(), Y.tolist(), strict=True)
    ]), {}),
    "other columns": ("a.csv",
        text(["Nr;Datum;t [ms];u [V];y [um]"], [f"{k};22.11.2026;{r}" for k, r in enumerate(lines())]), {}),
    "by units of measure": ("a.csv", text(["Stempel in ms;Kanal 1 in V;Kanal 2 in µm"], lines(comma=True)), {}),
    "by number": ("a.csv", text(["ms;V;um;V"], [f"{r};{r.split(';')[1]}" for r in lines()]), {
        "time": 1, "input": "2", "output": 3
    }),
    "no names": ("a.dat", text([], lines("\t")), {"rate": 2000.0, "input": 2, "output": 3}),
    "gzip": ("a.csv.gz", gzip.compress(text(GERMAN, lines(comma=True), "cp1252")), {}),
    "gzip in two members": ("a.csv.gz",
        gzip.compress(text(GERMAN, lines()[:20])) + gzip.compress(text([], lines()[20:])), {}),
    "MAT": ("a.mat", mat(time_ms=T * 1e3, u_V=U, y_um=Y, fs=2000.0), {}),
    "MAT, packed": ("a.mat", mat(time_ms=T * 1e3, u_V=U[:, None], y_um=Y[:, None], compressed=True), {}),
    "MAT, one matrix": ("a.mat", mat(data=np.column_stack([T, U, Y])), {
        "time": 1, "input": "data(:,2)", "output": 3
    }),
    "MAT, float32": ("a.mat", mat(t=T.astype(np.float32), u_V=U, y_um=Y), {}),
    "HDF5 with units": ("a.h5", lambda: hdf5(in_group), {}),
    "netCDF": ("a.h5", lambda: hdf5(as_netcdf), {}),
    "HDF5 with the rate of a group": ("a.h5", lambda: hdf5(with_step_of_a_group), {}),
    "MAT 7.3": ("a.mat", mat_7_3, {}),
    "HDF5 with two rates": ("a.h5", lambda: hdf5(with_two_rates), {"input": "slow/u", "output": "slow/y"}),
}  # fmt: skip
WITHOUT_UNITS = {"no names", "MAT, one matrix", "MAT 7.3"}


@pytest.mark.some(10)
@pytest.mark.parametrize("name", VARIANTS)
def test_a_file_is_read_to_the_truth(name, tmp_path):
    file, content, options = VARIANTS[name]
    path = tmp_path / file
    path.write_bytes(content() if callable(content) else content)
    data = read(path, **options)
    assert len(data.t) == N
    np.testing.assert_allclose(data.t, T, rtol=0, atol=1e-9)
    assert data.h == pytest.approx(1 / 2000, rel=1e-6)
    np.testing.assert_array_equal(data.u, U)
    np.testing.assert_array_equal(data.y, Y)
    assert (data.unit_u, data.unit_y) == (("", "") if name in WITHOUT_UNITS else ("V", "um"))
    assert data.read_as.startswith(f"read {file}: ")
    assert "\n" not in data.read_as
    if name in ("preamble", "comments between rows", "German Excel"):
        shown = f"{U[30]:.4f}"
        line = int(data.place(30).rpartition(" ")[2])
        text_line = path.read_bytes().decode("cp1252").splitlines()[line - 1]
        assert shown in text_line.replace(",", "."), text_line


def test_units_of_measure_go_on_to_the_ports_of_an_fmu(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(text(["t [ms];Eingang [mV];Ausgang [pm]"], lines(comma=True)))
    model = fit(read(path, output="Ausgang"), "prandtl_ishlinskii", N=3)
    assert [p.unit for p in model.graph.ports if p.kind in ("input", "output")] == ["mV", "pm"]
    with zipfile.ZipFile(model.export(tmp_path / "a.fmu")) as archive:
        description = archive.read("modelDescription.xml").decode()
    for unit, factor in (("mV", "0.001"), ("pm", "1e-12")):
        assert re.search(rf'<Unit name="{unit}">\s*<BaseUnit [^>]*factor="{factor}"', description)
        assert f'unit="{unit}"' in description


def test_the_end_of_summer_time_is_no_step_back(tmp_path):
    path = tmp_path / "a.csv"
    hours = ["02:59:58+02:00", "02:59:59+02:00", "02:00:00+01:00", "02:00:01+01:00"]
    path.write_text("time,u,y\n" + "".join(f"2026-10-25T{h},{k},{k % 3}\n" for k, h in enumerate(hours)))
    assert read(path).t.tolist() == [0.0, 1.0, 2.0, 3.0]


@pytest.mark.turn("files in a process of their own")
@pytest.mark.parametrize(("unit", "seconds"), [
    ("D", 86400.0), ("h", 3600.0), ("m", 60.0), ("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9),
])  # fmt: skip
def test_times_of_numpy_are_read_in_every_unit(unit, seconds):
    times = np.datetime64("2026-11-22", unit) + 7 * np.arange(9)
    found = read({"t": times, "u": np.arange(9.0), "y": np.arange(9.0) ** 2})
    assert found.t == pytest.approx(7 * seconds * np.arange(9), rel=1e-12)


def test_ten_thousand_columns_are_the_most():
    with pytest.raises(InputError, match=r"at most 10000 columns\. Got 10001 instead"):
        read(np.ones((5, 10_001)))
    assert read(np.column_stack([T, U, Y, np.ones((N, 9997))]), time=1, input=2, output=3).y.tolist() == Y.tolist()


def test_each_number_that_is_no_column_is_named(tmp_path):
    (tmp_path / "a.mat").write_bytes(mat(t=T, u=U, y=Y, gain=3.0, stage=7.0))
    assert "left out gain, stage" in read(tmp_path / "a.mat").read_as


def test_one_line_says_what_was_assumed(tmp_path):
    path = tmp_path / "piezo.csv"
    path.write_bytes(text([*PREAMBLE, *GERMAN], lines(comma=True), "cp1252"))
    assert read(path).read_as == (
        "read piezo.csv: cp1252, separator ';', decimal comma, 3 lines of preamble; time 'Zeit [ms]' in ms, "
        "input 'Spannung [V]', output 'Weg [µm]'"
    )
    path.write_bytes(text(["t,u,y"], lines(",", factor=1.0)))
    assert "time 't' in s (no unit of measure is stated)" in read(path).read_as
    path.write_bytes(text(["時間 [ms],電圧 [V],変位 [μm]"], lines(","), "cp932"))
    assert "cp932; time '時間 [ms]' in ms, input '電圧 [V]', output '変位 [μm]'" in read(path).read_as


@pytest.mark.parametrize("heading", ["t;voltage [V];strain [%]", "t;temperature;y", "t;u;reading"])
def test_one_column_left_for_one_role_is_clear(heading, tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(text([heading], [f"{k};{k % 3};{k}" for k in range(9)]))
    data = read(path)
    assert (data.u[:3].tolist(), data.y[:3].tolist()) == ([0.0, 1.0, 2.0], [0.0, 1.0, 2.0])
    assert all(repr(name) in data.read_as for name in heading.split(";"))


# ---- refused -------------------------------------------------------------------------------------------------------
REFUSED = {
    "thousands or decimals": (text(["t [s];u;y"], [f"{k};{k + 1},125;{k + 2},250" for k in range(9)]), {},
        ["line 2", "decimal sign must be clear", "'1,125'", "--decimal , or --decimal ."]),
    "two inputs": (text(["t;CH1 [V];CH2 [V];y"], [f"{k};1;2;{k}" for k in range(9)]), {},
        ["line 1", "The input must be one of the columns", "'CH1 [V]' and 'CH2 [V]'", "--input 2"]),
    "two outputs": (text(["t;u;a [um];b [um]"], [f"{k};1;2;{k}" for k in range(9)]), {}, ["output", "--output 3"]),
    "two times": (text(["time;Zeit;u;y"], [f"{k};{k};2;{k}" for k in range(9)]), {}, ["time", "--time 'time'"]),
    "unknown columns": (text(["t,a,b"], [f"{k},1,{k}" for k in range(9)]), {}, ["input", "Got t, a, b", "--input 2"]),
    "sensor or actuator": (text(["t,x [um],v [mV]"], [f"{k},1,{k}" for k in range(9)]), {},
        ["an actuator driven by 'v' or a sensor of 'x'"]),
    "no time": (text(["u;y"], [f"{k};{k}" for k in range(9)]), {}, ["must include a time", "--rate"]),
    "no names": (text([], [f"{k};{k};1" for k in range(9)]), {"rate": 1.0}, ["3 columns without names", "--input 2"]),
    "number of no column": (
        text(["t;u;y"], [f"{k};{k};1" for k in range(9)]), {"input": 4}, ["input column must be from 1 to 3. Got 4"]),
    "a name twice": (text(["t;u;u;y"], [f"{k};{k};1;1" for k in range(9)]), {"input": "u"},
        ["'u' must occur once", "number it, 2 and 3"]),
    "time of unknown unit": (
        text(["t [ticks];u;y"], [f"{k};1;{k}" for k in range(9)]), {}, ["time in s, ms", "--rate"]),
    "time of day without seconds": (
        text(["Time;u;y"], [f"12:0{k};{k};1" for k in range(9)]), {}, ["line 2", "'12:00'", "--rate"]),
    "stamps that are too coarse": (
        text(["Time;u;y"], [f"12:00:0{k // 2};{k};1" for k in range(9)]), {}, ["line 3", "must increase", "--rate"]),
    "a date in either order": (
        text(["Time;u;y"], [f"0{k}/02/2026 12:00:00;{k};1" for k in range(1, 9)]), {}, ["date must be clear", "--rate"],
    ),
    "an invalid stamp": (
        text(["Time;u;y"], [f"12:00:0{k if k != 4 else 'x'};{k};1" for k in range(9)]), {}, ["line 6", "'12:00:0x'"]),
    "stamps of another size than their unit": (
        text(["time [s];u;y"], [f"{1763800000000 + k};{k};1" for k in range(9)]), {}, ["of ms since 1970", "--rate"]),
    "a line of text between rows": (
        text(["t;u;y"], [*(f"{k};1;{k}" for k in range(5)), "overload", *(f"{k};1;{k}" for k in range(5, 9))]), {},
        ["line 7", "'overload'"]),
    "a row of text between rows": (
        text(["t;u;y"], [*(f"{k};1;{k}" for k in range(5)), "-;-;-", *(f"{k};1;{k}" for k in range(5, 9))]), {},
        ["line 7", "'-;-;-'"]),
    "a row of text, separators at the end": (
        text(["t;u;y;"], [*(f"{k};1;{k};" for k in range(5)), "s;V;m;", *(f"{k};1;{k};" for k in range(5, 9))]), {},
        ["line 7", "'s;V;m;'"]),
    "an end of text": (text(["t;u;y"], [*(f"{k};1;{k}" for k in range(9)), "End"]), {}, ["line 11", "'End'"]),
    "a missing value": (text(["t;u;y"], [f"{k};{'' if k == 4 else 1};{k}" for k in range(9)]), {}, ["line 6", "'u'"]),
    "a time that is infinite": (
        text(["t [s];u;y"], [f"{'inf' if k == 8 else k};1;{k}" for k in range(9)]), {}, ["line 10", "'t'", "finite"]),
    "a time as input": (text(["t;u;y"], [f"{k};1;{k}" for k in range(9)]), {"time": 1, "input": "t"},
        ["The input must be a column of its own. Got 't', the time"]),
    "two decimal signs": (
        text(["t;u;y"], [f"{k};{'1.5' if k == 4 else '2,5'};{k}" for k in range(9)]), {}, ["decimal sign", "--decimal"],
    ),
    "an output in an unknown form": (
        text(["t;u [V];Weg [nm]"], [f"{k};1;1 20{k},5" for k in range(9)]), {}, ["line 2", "'Weg'", "'1 200,5'"]),
    "a quote without end": (text(["t;u;y"], [f'{k};"1;{k}' for k in range(9)]), {}, ["line 2", "quoted cell must end"]),
    "names that do not fit": (
        text(["t;u"], [f"{k};1;{k}" for k in range(9)]), {}, ["line 2", "2 cells, as line 1", "Got 3"]),
    "an archive": (b"PK\x03\x04" + bytes(50), {}, ["zip archive", "unpack it"]),
    "a workbook of Excel 97": (b"\xd0\xcf\x11\xe0" + bytes(50), {}, ["save it as xlsx or CSV"]),
    "a MAT file with values of no type": (changed(mat(t=T, u=U, y=Y), 176, 148), {}, ["whole MAT file"]),
    "a MAT file that breaks off": (mat(t=T, u=U, y=Y)[:400], {}, ["whole MAT file"]),
    "a MAT file of text": (mat(run="now"), {}, ["'run' of class char", "as variables"]),
    "gzip that breaks off": (gzip.compress(text(GERMAN, lines()))[:60], {}, ["whole gzip archive"]),
    "gzip that unpacks to more": (gzip.compress(bytes(10**6)), {"most": 10**5}, ["at most 100000 bytes when unpacked"]),
    "columns of different time steps": (lambda: hdf5(with_two_rates), {"input": "fast/u", "output": "slow/y"},
        ["equal time steps", "'fast/u' (0.0001 s), 'slow/y' (0.0005 s)"]),
    "channels of different first times": (
        later_channel, {}, ["equal first times", "'Spannung' (0 s), 'Weg' (0.001 s)"]),
    "formulas without stored values": (formulas, {}, ["line 2", "'y'", "no stored value (save in Excel): =B2/2"]),
    "a missing value of netCDF": (
        lambda: hdf5(lambda file: as_netcdf(file, 1e9)), {}, ["row 4", "'y' column must hold finite numbers", "nan"]),
    "a MAT file of complex numbers": (mat(t=T, u=U, y=Y * (1 + 1j)), {}, ["'y'", "real numbers", "complex128"]),
    "an overload of an instrument": (text(["t;u;y"], [f"{k};1;{'9.9E+37' if k == 4 else k}" for k in range(9)]), {},
        ["line 6", "'y'", "finite", "9.9e+37 instead, which instruments write for an overload"]),
    "columns of different lengths": (
        mat(t=T, u=U, y=Y[:-1]), {}, ["equal lengths. Got u (40), y (39), t (40) instead"]),
}  # fmt: skip


@pytest.mark.some(10)
@pytest.mark.parametrize("name", REFUSED)
def test_what_is_not_clear_is_refused_with_the_remedy(name, tmp_path):
    content, options, words = REFUSED[name]
    path = tmp_path / "a.csv"
    path.write_bytes(content() if callable(content) else content)
    with pytest.raises(InputError) as e:
        read(path, **options)
    message = str(e.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    for word in words:
        assert word in message, message


@pytest.mark.parametrize("heading", [
    "# Sample Rate: 1,000 Hz",
    "# fs: 10 000 Hz",
    "# fs = 10'000",
    "# fs = 1.000,0 Hz",
    "# dt: 1,5 ms",
    "# fs = 2 kSps",
])  # fmt: skip
def test_an_unclear_rate_above_the_rows_is_not_used(heading, tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(text([heading, "u,y"], [f"{k / 8},{k}" for k in range(9)]))
    with pytest.raises(InputError, match="must include a time"):
        read(path)


def test_a_named_time_is_no_signal_if_the_rate_is_given(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(text(["stamp;u"], [f"{k};1" for k in range(9)]))
    assert not read(path, time="stamp", rate=100.0).has_output


@pytest.mark.parametrize("days", [
    ("8.1.2026 23", "9.1.2026 0"),
    ("8.1.26 23", "9.1.26 0"),
    ("31.12.2025 23", "1.1.2026 0"),
    ("1/8/2026 11", "1/9/2026 12"),
])  # fmt: skip
def test_a_date_without_zeros_goes_on_behind_midnight(days, tmp_path):
    path, half = tmp_path / "a.csv", " PM" * ("/" in days[0])
    stamps = [f"{days[0]}:59:5{k}{half}" for k in range(5, 10)] + [
        f"{days[1]}:00:0{k}{half and ' AM'}" for k in range(5)
    ]
    path.write_bytes(text(["Zeit;u;y"], [f"{stamp};1;{k}" for k, stamp in enumerate(stamps)]))
    assert read(path).h == pytest.approx(1.0)


def test_zeros_that_a_program_drops_are_digits(tmp_path):
    path, y = tmp_path / "a.csv", [0.0, 1.5, 0.5, 2.0, 1.0, 3.0, 0.25, 0.125]
    path.write_bytes(text(["t [s],u,y"], [f"{round(k / 3000, 9)!r},{k},{v}" for k, v in enumerate(y)]))
    data = read(path)
    assert "resampled" not in data.read_as
    np.testing.assert_array_equal(data.y, y)
    assert data.h == pytest.approx(1 / 3000, rel=1e-6)


def test_a_temperature_is_no_time(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(text(["t [s],u,y,T [degC]"], [f"{k},1,{k},20" for k in range(9)]))
    assert "time 't [s]' in s" in read(path).read_as


def test_the_first_record_shows_the_unit_of_the_time(tmp_path):
    path = tmp_path / "a.csv"
    rows = [f"{run},{k * 0.5},1,{k}" for run in (1, 2) for k in range(9)]
    path.write_bytes(text(["# fs: 2 kHz", "run,t,u,y"], rows))
    assert read(path, record="run").h == pytest.approx(1 / 2000)


@pytest.mark.turn("files in a process of their own")
def test_a_packed_mat_file_is_read_within_the_limit(tmp_path):
    zeros = np.zeros(10**6)
    path = tmp_path / "a.mat"
    path.write_bytes(mat(t=zeros, u_V=zeros, y_um=zeros, compressed=True))
    with pytest.raises(InputError, match=r"at most 100000 bytes\. Got 8000000 instead"):
        read(path, most=10**5)


@pytest.mark.turn("files in a process of their own")
def test_no_parser_of_others_runs_in_this_process(tmp_path):
    """An untrusted file could crash it: byte 176 above does that to scipy."""
    (tmp_path / "a.mat").write_bytes(mat(t=T, u=U, y=Y))
    (tmp_path / "b.mat").write_bytes(mat_7_3())
    script = (
        "import sys, hystfmu as hy; hy.read('a.mat'), hy.read('b.mat'); print({'h5py', 'scipy.io'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout == "set()\n", done.stderr


def test_hdf5_without_h5py_names_the_command(tmp_path, monkeypatch):
    path = tmp_path / "a.h5"
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(InputError, match=r"needs h5py, which is not installed: pip install 'hystfmu\[files\]'"):
        read(path)


def test_links_out_of_an_hdf5_file_are_not_followed(tmp_path):
    h5py = pytest.importorskip("h5py")
    (tmp_path / "other.h5").write_bytes(hdf5(in_group))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name in "tuy":
            file[name] = h5py.ExternalLink("other.h5", f"run/{name}")
    with pytest.raises(InputError, match="arrays of numbers"):
        read(tmp_path / "a.h5")


def test_special_files_are_refused():
    with pytest.raises(InputError, match="must be a regular file"):
        read("/dev/zero")
