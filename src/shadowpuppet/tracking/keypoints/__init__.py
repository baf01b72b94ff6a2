"""Keypoints, the joints that a detector finds in pictures, as evidence of a person's pose."""
