"""Run the command line as `python -m hystfmu.cli`, without the installed script."""

from hystfmu.cli import main

main(prog_name="hystfmu")
