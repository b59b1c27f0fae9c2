"""Simulated devices with solvers of their own: nothing here comes from the package."""
