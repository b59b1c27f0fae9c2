"""Measured and synthetic data: data sets, CSV files, resampling, test signals and synthetic plants."""

from hystfmu.data.dataset import Dataset

__all__ = ["Dataset"]
