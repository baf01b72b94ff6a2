"""Synthetic people: a mannequin of rounded limbs, which shares nothing with the bodies that trackers fit."""
