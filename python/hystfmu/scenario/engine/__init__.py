"""Who runs it: the master loop over FMUs and Python units, the native engine, foreign FMUs in their own process."""
