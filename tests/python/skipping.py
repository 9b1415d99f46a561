"""Tests of a module that is not built are skipped, and say so: exit code 77 is ctest's word for it."""
import os
import sys


def unless_built():
    missing = os.environ.get("LODESTONE_PYTHON_MISSING", "")
    if missing:
        print(f"SKIPPED: there is no Python module: {missing}")
        sys.exit(77)
