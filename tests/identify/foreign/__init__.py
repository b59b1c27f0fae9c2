"""Devices with solvers of their own, from the literature: nothing here comes from the package."""
