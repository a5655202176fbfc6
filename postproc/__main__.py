"""``python -m postproc`` is the console script ``compensate``."""

from postproc.cli.main import run

if __name__ == "__main__":
    run()
