"""A judge of what is read from KRL programs.

``machine`` executes a program as the controller would, from the description of the language; ``programs`` writes random
programs; ``judge`` compares every motion that is executed with what the reader says of its line.  Only ``claims`` knows
the reader.  ``python -m tests.krl_judge --count 5000 --seed 1``.
"""
