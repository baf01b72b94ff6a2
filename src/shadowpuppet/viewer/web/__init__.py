"""The viewer's page: server, timeline, panel, drawing with viser."""
