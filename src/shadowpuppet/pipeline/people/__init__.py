"""Several people in a recording: how many there are, the sizes of each, and a run folder for each."""
