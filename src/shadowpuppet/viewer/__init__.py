"""3D viewer of runs, recordings, priors and files over time: on a page that this machine serves to itself, or in one file."""
