"""From spec files to the modules under ``generated``: loading, compiling, printing, writing."""
