"""Pages, plots and terminal output.  This package knows neither models nor scenarios."""
