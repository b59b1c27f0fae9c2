"""Least-squares solvers: linear with a ridge, recursive, non-negative, and nonlinear for networks."""
