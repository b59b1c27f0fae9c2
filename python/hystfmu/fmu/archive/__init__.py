"""FMU archives: unpack untrusted ones within limits, write zip and XML files reproducibly."""
