"""Logs: recipes, readers and writers, and the pipeline that carries a filter's state through a file.

Needs the extra ``logs``; some formats of logs need one more.

Examples
--------
>>> from compfilt.logs import load_recipe, run_log
>>> summary = run_log(load_recipe("seat.toml"), "drive.parquet", "drive.roll.parquet")  # doctest: +SKIP
"""

from compfilt.logs.errors import LogError, RecipeError, TruncatedLog, UsageError
from compfilt.logs.faults import Faults
from compfilt.logs.parts import run_in_parts
from compfilt.logs.pipeline import Pipeline
from compfilt.logs.recipe import Recipe, load_recipe, parse_recipe
from compfilt.logs.run import Job, Outcome, Summary, run_job, run_log, run_logs
from compfilt.logs.watch import Watch

__all__ = [
    "Faults",
    "Job",
    "LogError",
    "Outcome",
    "Pipeline",
    "Recipe",
    "RecipeError",
    "Summary",
    "TruncatedLog",
    "UsageError",
    "Watch",
    "load_recipe",
    "parse_recipe",
    "run_in_parts",
    "run_job",
    "run_log",
    "run_logs",
]
