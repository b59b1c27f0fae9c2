"""One estimator for all graphs: linear free parameters are projected out, a search finds all other free parameters."""
