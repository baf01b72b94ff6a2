"""Whether calibrated cameras agree: tangency, agreement, time offset, rotation; a calibration in words."""
