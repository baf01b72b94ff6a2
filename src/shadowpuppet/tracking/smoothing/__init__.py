"""Motion smoothed backwards and forwards in time, as a pose of the body in every frame; short gaps bridged."""
