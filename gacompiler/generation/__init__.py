"""Load spec files, compile their kernels, and print and write the generated modules."""
