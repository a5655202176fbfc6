"""From the measured deviations of a part to their causes, and to a better next program."""

from postproc.learning import codes as codes
