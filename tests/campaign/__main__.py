"""The whole experiment, printed: python -m tests.campaign [--campaigns N] [--compensated N] [--seed N] [--jobs N]"""

import os
import sys
from pathlib import Path

# one thread a process, said before numpy comes; and what tests share
os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent.parent))

if __name__ == "__main__":
    from campaign.table import main

    raise SystemExit(main())
