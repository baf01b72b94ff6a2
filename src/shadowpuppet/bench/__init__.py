"""How fast it is on this machine, beside what one would write otherwise: all that `shadowpuppet bench` measures.

`mono.run_bench` gives flat keys: `mono.*` are the one-camera tracker's; another tracker's figures get a prefix and a module of their own
beside `mono`.
"""
