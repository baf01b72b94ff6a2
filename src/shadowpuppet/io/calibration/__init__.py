"""Calibrations as other programs write them: one module a format, all to `Draft`s; `io.calibration` makes cameras of these."""
