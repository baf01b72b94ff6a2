"""Keypoints of whole films, a module a format."""
