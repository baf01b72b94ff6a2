"""The viewer's page: as text, its scripts, its server, as one file; the body of a live session in space."""
