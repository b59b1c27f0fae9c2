"""Reading of measured data as labs write them: text files of many layouts, MAT and HDF5 files, `read`."""

from __future__ import annotations

from hystfmu.data.reader.reading import read

__all__ = ["read"]
