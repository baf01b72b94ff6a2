"""Each paper's algorithm on one frame, step by step: scripts in cells, and the pages of the documentation made from them."""
