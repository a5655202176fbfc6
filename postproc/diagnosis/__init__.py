"""Where model and measurement disagree, and the name of what is missing."""
