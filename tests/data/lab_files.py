"""The kinds of file that labs write, each made by the library or the program's format that writes it."""

import io
import json
from collections.abc import Callable, Sequence
from decimal import Decimal
from pathlib import Path

import numpy as np
from scipy.io import savemat

N, RATE = 2000, 2000.0
T = np.arange(N) / RATE
START = 1_763_800_000_000_000_000  # ns since 1970: 2025-11-22 08:26:40 UTC


def drive(t):
    """Input (V) at any time (s): amplitudes that decrease."""
    return 60 * np.sin(40 * t) * (1 - 0.5 * t)


def stroke(t):
    """Output (um)."""
    return 9 * np.sin(40 * t - 0.3) * (1 - 0.5 * t) - 0.5


U, Y = np.round(drive(T), 4), np.round(stroke(T), 4)
Columns = Sequence[Sequence[str]]


def numbers(values, form="{:.4f}", comma=False) -> list[str]:
    cells = [form.format(v) for v in values]
    return [c.replace(".", ",") for c in cells] if comma else cells


def text(head: Sequence[str], columns: Columns, separator=",", encoding="utf-8", edge="", end="") -> bytes:
    rows = [edge + separator.join(cells) + end for cells in zip(*columns, strict=True)]
    return ("\r\n".join([*head, *rows]) + "\r\n").encode(encoding)


def plain(t=T, u=U, y=Y, head="t,u,y", form="{:.6f}") -> bytes:
    return text([head], [numbers(t, form), numbers(u), numbers(y)])


def german(first: str, column: Sequence[str]) -> bytes:
    head = f"{first};Spannung [V];Weg [µm]"
    return text([head], [column, numbers(U, comma=True), numbers(Y, comma=True)], ";", "cp1252")


def thousands() -> bytes:
    cells = numbers(T * 1e6, "{:,.1f}")
    quoted = [f'"{c}"' for c in cells]
    return text(["Time,Drive,Response", "us,V,um"], [quoted, numbers(U), numbers(Y)])


def jittered() -> bytes:
    t = T + np.random.default_rng(3).uniform(-0.1, 0.1, N) / RATE
    return plain(t, drive(t), stroke(t), form="{:.9f}")


def dropped() -> bytes:
    kept = np.sort(np.random.default_rng(4).permutation(np.arange(1, N - 1))[: N * 99 // 100])
    kept = np.r_[0, kept, N - 1]
    return plain(T[kept], U[kept], Y[kept])


def stamps(form: str) -> list[str]:
    """Date and clock of each row in microseconds, by a format of strftime."""
    start = np.datetime64("2026-11-22T23:59:59.500", "us")  # the day changes
    times = (start + np.round(T * 1e6).astype("timedelta64[us]")).astype(object)
    return [t.strftime(form) for t in times]


def epoch(ns_of_a_count: int) -> bytes:
    stamped = START + np.round(T * 1e9).astype(np.int64)
    if ns_of_a_count == 10**9:
        cells = [f"{v // 10**9}.{v % 10**9 // 10**5:04d}" for v in stamped.tolist()]
    elif ns_of_a_count == 10**6:
        cells = [f"{v // 10**6}.{v % 10**6 // 10**5}" for v in stamped.tolist()]
    else:
        cells = [str(v // ns_of_a_count) for v in stamped.tolist()]
    return text(["timestamp,u,y"], [cells, numbers(U), numbers(Y)])


def lvm(with_x: bool) -> bytes:
    head = [
        "LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab", "Decimal_Separator\t.",
        "Multi_Headings\tNo", f"X_Columns\t{'One' if with_x else 'No'}", "Time_Pref\tRelative", "Operator\tlab",
        "Date\t2026/11/22", "Time\t10:15:00.123456", "***End_of_Header***\t", "\t", "Channels\t2\t\t",
        f"Samples\t{N}\t{N}\t", "Date\t2026/11/22\t2026/11/22\t", "Time\t10:15:00.123456\t10:15:00.123456\t",
        "Y_Unit_Label\tV\tum\t", "X_Dimension\tTime\tTime\t", "X0\t0.0000000000000000E+0\t0.0000000000000000E+0\t",
        f"Delta_X\t{1 / RATE:.6f}\t{1 / RATE:.6f}\t", "***End_of_Header***\t\t\t", "X_Value\tSpannung\tWeg\tComment",
    ]  # fmt: skip
    x = numbers(T, "{:.6f}") if with_x else [""] * N
    return text(head, [x, numbers(U, "{:.6f}"), numbers(Y, "{:.6f}")], "\t")


def keysight() -> bytes:
    head = ["x-axis,1,2", "second,Volt,Volt"]
    return text(head, [numbers(v, "{:+.10E}") for v in (T - 0.2, U, Y)])


def tektronix_all() -> bytes:
    head = [
        "Model,MSO3034", "Firmware Version,2.38", "", "Waveform Type,ANALOG,,", "Point Format,Y,,",
        "Horizontal Units,s,,", "Horizontal Scale,0.1,,", "Horizontal Delay,0.0,,", f"Sample Interval,{1 / RATE:g},,",
        f"Record Length,{N},,", "Gating,0.0% to 100.0%,,", "Probe Attenuation,10,1", "Vertical Units,V,V",
        "Vertical Offset,0,0", "Vertical Scale,20,5", "Vertical Position,-2.5,0.3", ",,", "Label,,", "TIME,CH1,CH2",
    ]  # fmt: skip
    return text(head, [numbers(v, "{:.6e}") for v in (T - 0.2, U, Y)])


def tektronix_beside() -> bytes:
    """The header stands to the left of the first rows."""
    header = [
        ("Record Length", f"{N:e}", "Points"), ("Sample Interval", f"{1 / RATE:e}", "s"),
        ("Trigger Point", "4.000000e+02", "Samples"), ("Source", "CH1", ""), ("Vertical Units", "V", ""),
        ("Vertical Scale", "2.000000e+01", ""), ("Horizontal Units", "s", ""), ("Horizontal Scale", "1.000000e-01", ""),
        ("Pt Fmt", "Y", ""), ("Probe Atten", "1.000000e+01", ""), ("Model Number", "TDS2014B", ""),
    ]  # fmt: skip
    left = [",".join(row) for row in header] + [",,"] * (N - len(header))
    return text([], [left, *(numbers(v, "{:.6f}") for v in (T - 0.2, U, Y))], end=",")


def rate_in_header() -> bytes:
    head = ["Messung;Piezo 3", "Abtastrate [Hz];2000", "Spannung [V];Weg [µm]"]
    return text(head, [numbers(U, comma=True), numbers(Y, comma=True)], ";", "cp1252")


def mat(**arrays) -> bytes:
    out = io.BytesIO()
    savemat(out, arrays, oned_as="column")
    return out.getvalue()


def dspace() -> bytes:
    """A recording of ControlDesk: X the time, Y the signals."""
    fields = [("Name", "O"), ("Type", "O"), ("Data", "O"), ("Unit", "O"), ("XIndex", "O")]
    signals = np.empty((1, 2), dtype=fields)
    signals[0, 0] = ("Model Root/drive/u", 4, U[None], "V", 1)
    signals[0, 1] = ("Model Root/sensor/y", 4, Y[None], "um", 1)
    x = {"Name": "HostService", "Type": 4, "Data": T[None], "Unit": "s", "Raster": "HostService"}
    return mat(rec_001={"X": x, "Y": signals, "Description": {"General": {"DateTime": "2026-11-22"}}})


def simulink() -> bytes:
    """A logged signal in the format "Structure With Time"."""
    fields = [("values", "O"), ("dimensions", "O"), ("label", "O"), ("blockName", "O")]
    signals = np.empty((1, 2), dtype=fields)
    signals[0, 0] = (U[:, None], 1.0, "u", "loop/drive")
    signals[0, 1] = (Y[:, None], 1.0, "y", "loop/sensor")
    return mat(ScopeData={"time": T[:, None], "signals": signals, "blockName": "loop/Scope"})


def hdf5(fill: Callable) -> bytes:
    import h5py

    out = io.BytesIO()
    with h5py.File(out, "w") as file:
        fill(file)
    return out.getvalue()


def in_groups(file) -> None:
    for name, column, unit in (("t", T * 1e3, "ms"), ("u", U, "V"), ("y", Y, "µm")):
        file.create_dataset(f"run/{name}", data=column).attrs["units"] = unit


def with_dt(file) -> None:
    """Also an internal table and a note, before the signals in the order of the names."""
    file.attrs["dt"] = 1 / RATE
    file["#refs#"], file["a note"] = U[:9], "a text"
    for name, column in (("u", U), ("y", Y)):
        file.create_dataset(f"{name}/value", data=column)


def numpy_file(save: Callable) -> bytes:
    out = io.BytesIO()
    save(out)
    return out.getvalue()


def arrow(write: str, index: bool = False) -> bytes:
    import pyarrow as pa

    names = ["u [V]", "y [um]", "__index_level_0__" if index else "t [s]"]
    t = pa.array(np.round(T * 1e6).astype(np.int64))
    times = t.cast(pa.timestamp("us")) if index else t.cast(pa.duration("us")) if write == "feather" else T
    y = pa.array([Decimal(cell) for cell in numbers(Y)]) if write == "feather" else Y
    table = pa.table(dict(zip(names, [U, y, times], strict=True)))
    if index:  # as pandas writes a data frame whose index has no name
        table = table.replace_schema_metadata({"pandas": json.dumps({"index_columns": names[2:]})})
    out = io.BytesIO()
    if write == "parquet":
        import pyarrow.parquet

        pyarrow.parquet.write_table(table, out)
    else:
        import pyarrow.feather

        pyarrow.feather.write_feather(table, out)
    return out.getvalue()


def xlsx(two: bool) -> bytes:
    from openpyxl import Workbook

    book = Workbook()
    sheet = book.active
    if two:
        sheet.append(["Prüfling", "Piezo 3"])
        sheet.append(["Datum", "22.11.2026"])
        sheet = book.create_sheet("Messung")
    sheet.append(["Zeit [ms]", "Spannung [V]", "Weg [µm]"])
    for row in zip((T * 1e3).tolist(), U.tolist(), Y.tolist(), strict=True):
        sheet.append(row)
    out = io.BytesIO()
    book.save(out)
    return out.getvalue()


def tdms(later: int = 0) -> bytes:
    from nptdms import ChannelObject, TdmsWriter

    out = io.BytesIO()
    with TdmsWriter(out) as writer:
        for name, column, unit, first in (("Spannung", U, "V", 0), ("Weg", Y, "um", later)):
            waveform = {"wf_increment": 1 / RATE, "wf_start_offset": first / RATE, "unit_string": unit}
            writer.write_segment([ChannelObject("Messung", name, column, properties=waveform)])
    return out.getvalue()


KINDS: dict[str, tuple[str, Callable[[], bytes]]] = {
    "plain": ("a.csv", plain),
    "units in brackets": ("a.csv", lambda: plain(T * 1e3, head="time (ms),drive (V),response (um)")),
    "German Excel": ("a.csv", lambda: german("Zeit [ms]", numbers(T * 1e3, "{:.1f}", comma=True))),
    "thousands, row of units": ("a.csv", thousands),
    "jittered stamps": ("a.csv", jittered),
    "1 % dropped rows": ("a.csv", dropped),
    "ISO stamps": ("a.csv", lambda: text(["timestamp,u,y"], [stamps("%Y-%m-%dT%H:%M:%S.%fZ"), numbers(U), numbers(Y)])),
    "German stamps": ("a.csv", lambda: german("Zeit", stamps("%d.%m.%Y %H:%M:%S,%f"))),
    "epoch in s": ("a.csv", lambda: epoch(10**9)),
    "epoch in ms": ("a.csv", lambda: epoch(10**6)),
    "epoch in us": ("a.csv", lambda: epoch(10**3)),
    "epoch in ns": ("a.csv", lambda: epoch(1)),
    "LVM": ("a.lvm", lambda: lvm(True)),
    "LVM without x": ("a.lvm", lambda: lvm(False)),
    "Keysight": ("a.csv", keysight),
    "Tektronix": ("a.csv", tektronix_all),
    "Tektronix, header beside": ("a.csv", tektronix_beside),
    "rate in the header": ("a.csv", rate_in_header),
    "MAT": ("a.mat", lambda: mat(t=T, u=U, y=Y)),
    "dSPACE": ("a.mat", dspace),
    "Simulink": ("a.mat", simulink),
    "HDF5 with groups": ("a.h5", lambda: hdf5(in_groups)),
    "HDF5 with dt": ("a.h5", lambda: hdf5(with_dt)),
    "npy": ("a.npy", lambda: numpy_file(lambda out: np.save(out, np.column_stack([T, U, Y])))),
    "npz": ("a.npz", lambda: numpy_file(lambda out: np.savez(out, u=U, y=Y, fs=RATE))),
    "parquet": ("a.parquet", lambda: arrow("parquet")),
    "parquet with index": ("a.parquet", lambda: arrow("parquet", index=True)),
    "feather": ("a.feather", lambda: arrow("feather")),
    "xlsx": ("a.xlsx", lambda: xlsx(False)),
    "xlsx, two sheets": ("a.xlsx", lambda: xlsx(True)),
    "TDMS": ("a.tdms", tdms),
    "text with blanks": ("a.txt", lambda: text(["  t   u   y"], [numbers(c, "{:12.5f}") for c in (T, U, Y)], " ")),
}
"""Name of the file and its bytes; all hold T, U and Y, from another first time on."""


def write(folder: Path, kind: str) -> Path:
    """Write one kind of file."""
    name, make = KINDS[kind]
    path = folder / name
    path.write_bytes(make())
    return path
