"""The files that a run depends on: which they are, what they hold, and whether they change while it goes or before it goes on."""
