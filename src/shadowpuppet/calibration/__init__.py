"""Tests of a calibration by silhouettes (epipolar tangency, agreement, time offsets, rotation errors), and its overview."""
