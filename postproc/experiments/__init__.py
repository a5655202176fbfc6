"""Which poses and loads are worth measuring: what can be set up, what it would show, and the best choice of it."""

from postproc.experiments import codes as codes
