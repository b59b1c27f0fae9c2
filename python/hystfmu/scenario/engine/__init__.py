"""Engines of a run: the master loop over FMUs, the native engine, foreign FMUs in their own process."""
