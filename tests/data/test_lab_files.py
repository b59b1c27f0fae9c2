"""Files of labs at the first call: the record comes back, or one line says what to do; none is read wrong."""

import lab_files
import numpy as np
import pytest
from lab_files import KINDS, RATE, U, Y, drive, stroke

from hystfmu import InputError, read


def outcome(path, kind) -> str:
    """Whether a file is read right, wrong, or refused."""
    try:
        data = read(path)
    except InputError as e:
        return f"refused: {e}"
    if abs(data.h * RATE - 1) > (1e-3 if kind == "jittered stamps" else 1e-6):
        return f"wrong step {data.h}"
    if kind == "jittered stamps":
        faults = np.abs([data.u - drive(data.t), data.y - stroke(data.t)]).max()
        return "right" if faults < 0.2 else f"wrong by {faults}"
    if len(data.t) != len(U):
        return f"wrong length {len(data.t)}"
    even = np.abs(data.t - data.t[0] - np.arange(len(U)) / RATE).max() < 1e-9
    slack = 0.05 if kind == "1 % dropped rows" else 1e-9
    right = even and np.abs([data.u - U, data.y - Y]).max() < slack
    return "right" if right else "wrong"


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_is_read_at_the_first_call(kind, tmp_path):
    for package, kinds in (("h5py", "HDF5"), ("pyarrow", "parquet feather"), ("openpyxl", "xlsx"), ("nptdms", "TDMS")):
        if any(k in kind for k in kinds.split()):
            pytest.importorskip(package)
    path = lab_files.write(tmp_path, kind)
    assert outcome(path, kind) == "right"
