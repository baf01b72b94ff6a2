"""Several people before several cameras: how many there are and where, which pixel is whose, and one tracker's state for each."""
