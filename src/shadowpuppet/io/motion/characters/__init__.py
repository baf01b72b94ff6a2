"""Skeletons as characters of animation programs: their bones' names, and USD."""
