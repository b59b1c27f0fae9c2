"""Measured and synthetic data: data sets, CSV files, resampling, test signals and synthetic plants."""

from __future__ import annotations

from hystfmu.data.dataset import Dataset

__all__ = ["Dataset"]
