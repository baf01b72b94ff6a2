"""Measurements of `shadowpuppet bench`: speed on this machine, compared with naive versions of the same steps.

`run.run_bench` returns flat keys: `mono.*` for the one-camera tracker, `multi.*` for several cameras; each has a module.
"""
