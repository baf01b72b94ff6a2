"""A page about one run: how good it is, in figures, plots and pictures. Needs the extra `report`."""
