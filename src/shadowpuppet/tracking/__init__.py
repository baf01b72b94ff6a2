"""The trackers, and what both papers share: particle filter, resampling, silhouette cost, status, recovery."""
