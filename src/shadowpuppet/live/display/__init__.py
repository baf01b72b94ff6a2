"""Displays of a live session: a page for a browser, or none."""
