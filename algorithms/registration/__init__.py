"""Registration by planes in joint space, tensor voting, and partial scans from any pose."""
