"""One .belief file opened in a process of its own: CPU time and memory, ours first, then all of it read plainly.

A program of `openbelief bench open`: prints one line of JSON.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
import sys
from contextlib import closing
from pathlib import Path

import numpy as np

from openbelief.memory import ObjectMemory
from robot_app.benches.cpu import cpu_s


def peak_mb() -> int:
    """The most memory of this program so far; what getrusage tells includes the one that started it."""
    [line] = [line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM:")]
    return int(line.split()[1]) >> 10


def read_plainly(path: str) -> int:
    """The textbook's way: every observation into arrays, every row hashed."""
    sha, read = hashlib.sha256(), []
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as db:
        for frame, mask, phrase, points, feature in db.execute(
            "SELECT frame, mask, phrase, points, feature FROM observations ORDER BY id"
        ):
            sha.update(repr((frame, mask, phrase)).encode() + points + feature)
            arrays = np.frombuffer(points, "<f4").reshape(-1, 3).copy(), np.frombuffer(feature, "<f4").copy()
            read.append((frame, mask, phrase, *arrays))
    return len(read)


def main(path: str) -> None:
    began_mb = peak_mb()
    open_s, memory = cpu_s(lambda: ObjectMemory.open(path))
    opened_mb = peak_mb()
    query = np.eye(memory.text_dim)[0]
    answer_s, _ = cpu_s(lambda: memory.rank(query, limit=10))
    node_s, node = cpu_s(lambda: memory.objects[len(memory.objects) // 2])
    points_s, points = cpu_s(lambda: node.points)
    answered_mb = peak_mb()
    plain_s, count = cpu_s(lambda: read_plainly(path))
    equal = count == len(memory.observations)
    print(
        json.dumps(
            {
                "objects": len(memory.objects),
                "observations": count,
                "open_cpu_s": round(open_s, 4),
                "first_answer_cpu_s": round(answer_s, 4),
                "one_object_cpu_s": round(node_s + points_s, 4),
                "points": len(points),
                "opened_mb": opened_mb - began_mb,
                "answered_mb": answered_mb - began_mb,
                "process_mb": answered_mb,
                "plain_cpu_s": round(plain_s, 4),
                "plain_mb": peak_mb() - began_mb,
                "ratio": round(plain_s / open_s, 1),
                "equal": equal,
            }
        )
    )


if __name__ == "__main__":
    main(sys.argv[1])
