"""Recordings whose masks or keypoints a script makes."""
