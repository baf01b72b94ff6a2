"""The floor, and the feet's contact with it: found in a motion's heels and toes, and measured against a truth."""
