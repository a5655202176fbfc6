"""What every room uses: documents, arrays, geometry, units, findings, tables."""
