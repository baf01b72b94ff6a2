"""How made people move: gestures, gait, paths, motion capture."""
