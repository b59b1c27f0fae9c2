"""Parquet and feather files by pyarrow: columns of numbers and times."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from hystfmu.base.told_arrays import Found, serve, since_first

INDEX = "__index_level_0__"  # an index of pandas without a name
PARQUET = b"PAR1"


def arrays(source: str) -> tuple[list[Found], list[str]]:
    """Return the columns."""
    import pyarrow as pa

    pa.set_cpu_count(1)
    pa.set_io_thread_count(1)
    with open(source, "rb") as file:
        start = file.read(len(PARQUET))
    if start == PARQUET:
        import pyarrow.parquet

        table = pyarrow.parquet.ParquetFile(source).read(use_threads=False)
    else:
        import pyarrow.feather

        table = pyarrow.feather.read_table(source, memory_map=False, use_threads=False)
    return [f for k in range(table.num_columns) for f in _found(pa, table.field(k), table.column(k))], []


def _found(pa: Any, field: Any, column: Any) -> list[Found]:
    """Return a column, if it is one of numbers or times."""
    kind, name = field.type, field.name
    told = field.metadata or {}
    unit = next((told[k].decode("utf-8", "replace") for k in (b"unit", b"units") if k in told), "")
    if name == INDEX:
        if pa.types.is_integer(kind):  # it numbers rows
            return []
        name = "index"
    if pa.types.is_timestamp(kind) or pa.types.is_time(kind) or pa.types.is_date64(kind):
        scale = {"date64[day]": "ms", "date64[ms]": "ms"}.get(str(kind)) or kind.unit
        width = pa.int32() if pa.types.is_time32(kind) else pa.int64()
        counts = column.cast(width).to_numpy().astype(np.int64)
        seconds, first = since_first(counts.view(f"datetime64[{scale}]"))
        return [Found(name, seconds.shape, seconds.nbytes, lambda: seconds, "s", first)]
    if pa.types.is_duration(kind):
        found = column.to_numpy() / np.timedelta64(1, "s")
        return [Found(name, found.shape, found.nbytes, lambda: found, "s")]
    if pa.types.is_decimal(kind):
        column, kind = column.cast(pa.float64()), pa.float64()
    if not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind)):
        return []
    return [Found(name, (len(column),), 8 * len(column), partial(column.to_numpy), unit)]


if __name__ == "__main__":
    serve(arrays)
