"""Reading of measured data in the usual formats: text files of many layouts, MAT and HDF5 files, `read`."""

from __future__ import annotations

from hystfmu.data.reader.reading import read

__all__ = ["read"]
