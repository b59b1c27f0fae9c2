"""FMU archives: unpack untrusted files within limits, write ZIP and XML files reproducibly."""
