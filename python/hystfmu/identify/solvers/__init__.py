"""Least-squares solvers: linear with a ridge, non-negative, and nonlinear for networks."""
