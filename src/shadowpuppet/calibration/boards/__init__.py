"""Calibration boards: what they look like, printed and found in pictures."""
