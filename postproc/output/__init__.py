"""The output: written, read back and checked, replaced atomically."""
