"""Tracking as it happens: a camera, a stream, or a film played as if it were one."""
