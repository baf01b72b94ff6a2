"""Other programs that make masks or keypoints of a film: small scripts, each in an environment of its own.

The package imports none of these scripts and none of what they need. A script starts with inline metadata (PEP 723), which name the
Python versions and packages that it needs. It is called once for each film, as

    script.py FILM WIDTH HEIGHT

reads the film's frames from standard input (HEIGHT x WIDTH x 3 bytes each, blue green red, until the input ends) and writes what it makes
of each to standard output: `silhouette.external.masks` and `io.made.script_keypoints` say how. `scripts/masks/template.py` and
`scripts/keypoints/template.py` are to start from.
"""
