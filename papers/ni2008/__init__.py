"""The experiments of Ni, Kassim and Winkler (2008): python -m papers.ni2008."""
