"""Run the command line as `python -m hystfmu.cli`, without the installed script."""

from hystfmu.cli import main

try:
    main(prog_name="hystfmu")
finally:
    # CPython remembers an interrupt in code that was compiled from a string, such as a data class, even if it was
    # caught: `python -m` would end by the signal and not with our status.  Other compiled code clears this mark.
    exec("")
