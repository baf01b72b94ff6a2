"""Recordings whose silhouettes another program made."""
