"""Refinement of poses to surface points: simulated forces (Ni 2008, V-B), Gauss-Newton."""
