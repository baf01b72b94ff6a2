"""Programs whose files have the syntax of a common reader but rules of their own."""
