"""Surface points of the visual hull (Ni 2008, III)."""
