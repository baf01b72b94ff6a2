"""What is found of a recording before a run, and of the run: figures, severity and words."""
