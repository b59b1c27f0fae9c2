"""Estimator of the free parameters of any graph: least squares for linear parameters, a search for all others."""
