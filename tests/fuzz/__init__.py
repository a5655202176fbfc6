"""Hostile programs: real ones mutated, read, moved and read back (``python -m tests.fuzz FOLDER``)."""
