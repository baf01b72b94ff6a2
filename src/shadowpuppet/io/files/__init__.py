"""Reads and writes files of text, TOML, tables and arrays safely."""
