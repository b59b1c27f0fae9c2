"""Measured and synthetic data: `Dataset`, CSV files, resampling, test signals, synthetic plants."""

from __future__ import annotations

from hystfmu.data.dataset import Dataset

__all__ = ["Dataset"]
