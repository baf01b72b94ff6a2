"""Masks made by other programs.

A script (`shadowpuppet.external`) writes a mask for each frame: HEIGHT x WIDTH bytes, 255 is the person, 0 is not.
"""
