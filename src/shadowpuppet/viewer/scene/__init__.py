"""What there is to be shown of runs, recordings, priors and files, as plain data."""
