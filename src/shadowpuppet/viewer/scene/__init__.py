"""Scenes of runs, recordings, priors and files, as plain data for the viewer."""
