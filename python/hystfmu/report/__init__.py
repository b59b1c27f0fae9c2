"""HTML pages, plots and terminal output, independent of models and scenarios."""
