"""CSV files as columns: every mistake is told with file, line and column name."""

from postproc.tables.spelling import as_cell, finite_number, is_missing
from postproc.tables.table import Table, comments_above, read_table

__all__ = ["Table", "as_cell", "comments_above", "finite_number", "is_missing", "read_table"]
