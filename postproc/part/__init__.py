"""The surface of the part: which motion leaves which place of it."""
