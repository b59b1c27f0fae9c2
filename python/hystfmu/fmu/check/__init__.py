"""Check an FMU of any origin: archive, static checks, and trial runs in a child process."""
