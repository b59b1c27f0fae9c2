"""Least-squares solvers: linear with a ridge, non-negative, by trust-region steps, and nonlinear for networks."""
