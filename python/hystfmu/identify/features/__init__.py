"""What models are made of before a readout: plays, monomials, auxiliary functions, initial memory, dead band."""
