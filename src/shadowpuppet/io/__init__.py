"""Files: one module a format, reading beside writing."""
