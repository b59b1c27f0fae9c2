"""Readers of measured data: text files of many layouts, workbooks, and binary files such as MAT and HDF5."""

from hystfmu.data.reader.reading import read

__all__ = ["read"]
