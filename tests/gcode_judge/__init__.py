"""LinuxCNC's interpreter as the judge of how G-code is read: made-up programs, motion by motion.

expressions, generator   programs from a seed; the grammar stands in their docstrings
blocks                   a program as blocks of words
oracle                   the motions of rs274, and the lines that they come from
reading                  the motions that the reader of ``postproc`` claims to know: the one place that names it
comparison               what the two differ in
shrinking                the least program that still differs
known                    differences that are known
command                  ``python -m tests.gcode_judge --count 10000 --seed 1``
"""
