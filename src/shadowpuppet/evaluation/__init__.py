"""How good a run is, against a truth and by itself; how fast the trackers are (`bench`)."""
