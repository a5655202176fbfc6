"""python -m tests.inserted_statements LANGUAGE [--count N] [--seed S] [--each K] [--files FILE ..]"""

import argparse
import sys
from collections import defaultdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))


def main() -> int:
    from inserted_statements.drawn import LANGUAGES, drawn
    from inserted_statements.scan import few, judged

    parser = argparse.ArgumentParser(prog="python -m tests.inserted_statements", description=__doc__)
    parser.add_argument("language", choices=LANGUAGES)
    parser.add_argument("--files", nargs="*", default=[], type=Path, help="programs in place of drawn ones")
    parser.add_argument("--count", type=int, default=20, help="programs that are drawn (20)")
    parser.add_argument("--seed", type=int, default=1, help="of the first program (1)")
    parser.add_argument(
        "--each", type=int, default=200, help="statements that are put into each; 0: all, at all places"
    )
    given = parser.parse_args()
    language = LANGUAGES[given.language]
    texts = {str(file): file.read_bytes().decode("latin-1") for file in given.files} or {
        f"seed {seed}": drawn(given.language, seed) for seed in range(given.seed, given.seed + given.count)
    }
    wrong = defaultdict(list)
    count = 0
    for number, (name, text) in enumerate(texts.items()):
        for one in judged(language, text, few(given.each, given.seed + number) if given.each else list):
            count += 1
            if one is not None:
                wrong[one.kind, one.statement.text].append(f"{name}: {one}")
    for found in wrong.values():
        print(f"{len(found)} times, {found[0]}")
    print(f"{len(texts)} programs, {count} statements judged, {len(wrong)} that are silent or needless")
    return min(len(wrong), 1)


if __name__ == "__main__":
    raise SystemExit(main())
