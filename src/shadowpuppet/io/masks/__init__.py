"""Silhouettes that another program made."""
