"""python -m tests.mutation FOLDER [--room R ...] [--sample N] [--seed S] [--seconds T] [--confirm T] (all: --help)"""

import os
import sys
from pathlib import Path

# one thread a process, said before numpy comes
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent.parent))

if __name__ == "__main__":
    from mutation.command import main

    raise SystemExit(main())
