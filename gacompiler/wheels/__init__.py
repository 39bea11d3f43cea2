"""Build wheels: packages of generated kernels, and compiled libraries for wheels that contain generated modules."""
