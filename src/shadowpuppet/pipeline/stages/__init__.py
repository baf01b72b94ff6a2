"""Stages of a run that take more than a call: what is written, and what is smoothed."""
