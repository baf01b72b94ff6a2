"""The command line: commands, flags, tables, terminal."""
