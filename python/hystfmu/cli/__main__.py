"""`python -m hystfmu.cli`: the command line without its installed script."""

from hystfmu.cli import main

main(prog_name="hystfmu")
