"""An interpreter of Fanuc TP that shares no code with the package, and programs for it."""
