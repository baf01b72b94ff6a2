"""Runs, recordings, priors and files to look at in space and time, on a page that this machine serves to itself, or in one file."""
