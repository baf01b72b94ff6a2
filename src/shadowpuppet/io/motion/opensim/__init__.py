"""OpenSim: marker names, coordinates of full-body models, MOT files, and a model of our own skeleton."""
