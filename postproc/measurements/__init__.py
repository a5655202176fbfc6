"""Measurements: the CSV of readings, checked.

Comments that state something, a header row, then one row a reading, in the order of time::

    # robot: kuka_kr270
    # tool: 0 0 300
    # target M1: 60 0 345
    A1,A2,A3,A4,A5,A6,FX,FY,FZ,DX,DY,DZ,TARGET
    0,-90,90,0,45,0,0,0,-2500,0.1021,0.0033,-1.2040,M1

The file is in mm, deg, N, N m, s and degC.  ``read_measurements`` reads it, ``measurements_csv`` writes it.
"""

from postproc.measurements import codes as codes
from postproc.measurements.copied_rows import not_fitted
from postproc.measurements.header import value_columns
from postproc.measurements.header_comments import robot_named
from postproc.measurements.joining import joined
from postproc.measurements.read_csv import read_measurements
from postproc.measurements.readings import Readings, planned
from postproc.measurements.write_csv import measurements_csv

__all__ = [
    "Readings",
    "joined",
    "measurements_csv",
    "not_fitted",
    "planned",
    "read_measurements",
    "robot_named",
    "value_columns",
]
