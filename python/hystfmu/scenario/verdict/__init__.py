"""Verdicts of a run: limits, baselines, the verdict on every metric."""
