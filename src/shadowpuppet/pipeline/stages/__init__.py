"""Stages of a run that take more than a call: its ends, what is written, and what is smoothed."""
