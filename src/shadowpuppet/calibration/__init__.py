"""Do calibrated cameras agree? Epipolar tangency, agreement, time offsets and rotation errors; overview of a calibration."""
