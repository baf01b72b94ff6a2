"""Lenses and places of cameras solved from views of a board."""
