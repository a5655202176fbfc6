"""python -m tests.gcode_judge [--count N] [--seed S] [--shrink K] [--processes P] [--show SEED]"""

import os
import sys
from pathlib import Path

# one thread a process, said before numpy comes; and what tests share
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent.parent))

if __name__ == "__main__":
    from gcode_judge.command import main

    raise SystemExit(main())
