"""Quality of a run, against a truth and by itself."""
