"""Ni, Kassim, Winkler 2008: several cameras, a motion prior, refined particles."""
