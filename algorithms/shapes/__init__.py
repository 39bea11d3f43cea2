"""Contours, surfaces, segments of volumes, and models of spheres."""
