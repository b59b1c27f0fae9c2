"""One estimator for all graphs: free parameters, linear ones projected out, searched from several starts."""
