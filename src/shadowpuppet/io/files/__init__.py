"""Text, tables, TOML and arrays, read and written safely."""
