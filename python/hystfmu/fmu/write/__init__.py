"""Export of FMUs: model description, documentation, terminals, reference experiment, binaries and C source."""
