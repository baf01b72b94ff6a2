"""Files of text, TOML, tables and arrays, read and written safely."""
