"""Faults of a synthetic recording's pictures: light, sensor, optics, tripod and timing; each kind is a row of `kinds.KINDS`."""
