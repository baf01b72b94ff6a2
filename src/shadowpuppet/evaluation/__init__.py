"""Quality of a run, against a truth and by itself; speed of the trackers (`bench`)."""
