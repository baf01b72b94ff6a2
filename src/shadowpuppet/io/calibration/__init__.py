"""Calibration files of other programs: each module reads one format as `Draft`s; `calibration_files` makes cameras of these."""
