"""Where bytes leave the house: written, read back and checked, replaced atomically."""
