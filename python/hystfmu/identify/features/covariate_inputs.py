"""Inputs of a model for the covariates of its data."""

from __future__ import annotations

from collections.abc import Sequence

from hystfmu.data import Dataset
from hystfmu.graph import Input


def covariate_inputs(data: Dataset, to: Sequence[tuple[str, ...]]) -> list[Input]:
    """Return an input for each covariate, whose start value is its mean over the training rows.

    Parameters
    ----------
    data : Dataset
    to : sequence of tuple of str
        Endpoints that each drives.
    """
    return [
        Input(name, ends, unit, float(values[data.train].mean()), "covariate")
        for (name, unit, values), ends in zip(data.covariates, to, strict=True)
    ]
