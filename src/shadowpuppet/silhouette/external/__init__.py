"""Masks made by other programs: small scripts, each in an environment of its own.

The package imports none of these scripts and none of what they need. A script starts with inline metadata (PEP 723), which name the
Python versions and packages that it needs. It is called once for each film, as

    script.py FILM WIDTH HEIGHT

reads the film's frames from standard input (HEIGHT x WIDTH x 3 bytes each, blue green red, until the input ends) and writes a mask for
each frame to standard output (HEIGHT x WIDTH bytes: 255 is the person, 0 is not). `scripts/template.py` is one to start from.
"""
