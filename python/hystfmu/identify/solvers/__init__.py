"""Least squares: trainers of networks, non-negative, penalised, recursive."""
