"""What both papers share: particle filter, resampling, silhouette cost, status."""
