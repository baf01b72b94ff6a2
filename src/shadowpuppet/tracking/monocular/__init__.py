"""Liu, Lee, Sepp 2011: one camera, a hierarchical particle filter."""
