"""Motion of synthetic people: gestures, whole-body actions, gait along paths, motion capture."""
