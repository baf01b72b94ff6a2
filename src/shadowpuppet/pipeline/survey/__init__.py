"""A recording examined before a run."""
