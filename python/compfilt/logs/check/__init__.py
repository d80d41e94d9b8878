"""What a log seems to be, before anyone filters it: units, rate, axes, gaps, rests, and what is damaged.

Everything is read in one pass and in bounded memory: counts of every row, the first 131 072 rows, and an extract of at most 1024
pieces of 8 s, which lie evenly over the log (`segments`). The gyro is held against what gravity and the magnetic field do
(`turning`); that needs no truth, only that the body turns away from the vertical now and then.
"""

from compfilt.logs.check.check import check_log
from compfilt.logs.check.report import Finding, Report

__all__ = ["Finding", "Report", "check_log"]
