"""Speed on this machine, beside plain versions of the same: what `shadowpuppet bench` measures.

`run.run_bench` returns flat keys: `mono.*` for the one-camera tracker, `multi.*` for several cameras; each has a module.
"""
