"""Parts of `benchmarks/bench.py`: what is timed, and the plain versions of the same steps that it is compared with."""
