"""What has changed in a frame since the empty scene, found and undone: movement of the camera, changes of light; and what is too much."""
