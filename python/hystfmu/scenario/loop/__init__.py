"""Linearised loop of a case: dynamics of the plant, incremental gains along the path, delay margins by simulation."""
