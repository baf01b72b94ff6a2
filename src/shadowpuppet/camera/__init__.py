"""A body as a camera sees it: projection, rasterised silhouettes, masks, drawing."""
