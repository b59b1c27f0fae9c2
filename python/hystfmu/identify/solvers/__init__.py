"""Least squares: Levenberg-Marquardt, conjugate gradients, non-negative, recursive."""
