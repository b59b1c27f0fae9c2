"""The one exception that means "the user's input is wrong": its text is a single line that says what to change."""


class InputError(ValueError):
    """Bad input: names the file, the row or key, the rule and the value.  The command line prints it and exits 2."""
