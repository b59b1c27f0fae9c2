"""Export of FMUs: model description, documentation, terminals, reference experiment, binaries, source."""
