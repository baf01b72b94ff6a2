"""Live tracking of a camera, a network stream, or a film played as if live."""
