"""How a camera sees a body: projection, rasterised silhouettes, masks, drawing."""
