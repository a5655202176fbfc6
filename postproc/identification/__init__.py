"""Parameters of the model from measurements: what a campaign saw, the fit, and how far it can be believed."""

from postproc.identification import codes as codes
