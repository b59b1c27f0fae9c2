"""Exception for wrong user input; its one-line text states the remedy."""

from hystfmu.base.printable import printable


class InputError(ValueError):
    """Invalid user input.

    The message is one line: file and line or key, subject, rule, value.  Example: "The 'rho' parameter of sliding_mode
    must be a float in [0, inf). Got -1 instead."  The command line prints it and exits with status 2.

    Examples
    --------
    >>> import hystfmu as hy
    >>> try:
    ...     hy.blocks.SlidingMode(rho=-1)
    ... except hy.InputError as e:
    ...     print(e)
    The 'rho' parameter of sliding_mode must be a float in [0, inf). Got -1 instead.
    """

    def __str__(self) -> str:
        """Return the line with control characters escaped, so that names and values of a file cannot control the
        terminal."""
        return printable(" ".join(super().__str__().split()))
