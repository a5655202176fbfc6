"""CSV files as columns: every mistake is reported with file, line and column name."""

from postproc.base.tables.csv_spelling import as_cell, finite_number, is_missing, mixes_decimals
from postproc.base.tables.csv_table import CsvTable, comments_above, read_table

__all__ = [
    "CsvTable",
    "as_cell",
    "comments_above",
    "finite_number",
    "is_missing",
    "mixes_decimals",
    "read_table",
]
