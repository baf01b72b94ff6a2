"""A verdict on a recording before it is tracked, and on a run after that."""
