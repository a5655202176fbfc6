"""The whole benchmark: python -m tests.blind_parts [--rows a,b] [--draws N] [--seed S] [--out FILE]"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

# one thread a process, stated before numpy comes; and what tests share
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent.parent))


def main() -> int:
    from blind_parts.rows import OPTIONS, RARE, Learner, draw, prepare_shops
    from blind_parts.table import lines_of

    parser = argparse.ArgumentParser()
    parser.add_argument("--rows", default=",".join(OPTIONS))
    parser.add_argument("--draws", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--table", type=Path, nargs="*", help="only the table of files that --out wrote")
    chosen = parser.parse_args()
    if chosen.table:
        answers = [json.loads(line) for path in chosen.table for line in path.read_text().splitlines()]
        print("\n".join(lines_of(answers)))
        return 0
    answers = []
    with tempfile.TemporaryDirectory() as folder:
        shops = prepare_shops(Path(folder))
        learner = Learner()
        for number in range(chosen.draws):
            for row in chosen.rows.split(","):
                if row in RARE and number % 3 and chosen.rows.count(","):
                    continue
                answer = draw(row, chosen.seed + number, shops, learner)
                answers.append(answer)
                if chosen.out is not None:
                    with chosen.out.open("a") as stream:
                        stream.write(json.dumps(answer) + "\n")
        learner.close()
    print("\n".join(lines_of(answers)))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
