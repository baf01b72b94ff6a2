"""Liu, Lee and Sepp (2011): every figure and table, and what is said without being shown. `python -m papers.liu2011` lists them."""
