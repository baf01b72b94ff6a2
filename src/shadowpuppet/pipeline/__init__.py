"""A recording in, a run folder out: look, person, track; many of them in `batch`."""
