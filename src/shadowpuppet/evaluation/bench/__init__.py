"""How fast it is on this machine, beside what one would write otherwise: all that `shadowpuppet bench` measures.

`whole.run_bench` gives flat keys: `mono.*` are the one-camera tracker's, `multi.*` those of several cameras; each has a module.
"""
