"""The experiments of the two papers, a command each: `python -m papers.liu2011`, `python -m papers.ni2008` list them."""
