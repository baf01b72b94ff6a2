"""Motion files: a module a format."""
