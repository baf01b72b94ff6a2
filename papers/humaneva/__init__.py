"""HumanEva, which needs a licence: its trials as recordings, for the experiments of Ni 2008."""
