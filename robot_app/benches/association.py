"""Association of a synthetic site: CPU time, memory, and the same partition by a sweep with kd-trees and union-find.

Objects have 40 views of 500 to 2000 points each. Fails where the two partitions differ.
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from robot_app.benches.cpu import beside_plain, count, cpu_s, peak_mb, said
from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from openbelief.arrays import Array


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--observations", type=count, nargs="+", default=[1000], metavar="N", help="sizes of the site (default 1000)"
    )
    parser.add_argument(
        "--plain-up-to", type=count, default=20_000, metavar="N", help="larger sites without it (default 20000)"
    )


def run(options: argparse.Namespace) -> None:
    rows = [_measured(size, options.plain_up_to) for size in sorted(options.observations)]
    if options.json:
        print_json({"sites": rows})
    else:
        print("\n".join(_line(row) for row in rows))
    if any(row["equal"] is False for row in rows):
        raise Failure("the plain way found other objects: that is a defect, please report it with this machine's name")


def _measured(size: int, plain_up_to: int) -> dict[str, Any]:
    import numpy as np

    from openbelief import Parameters, associate
    from robot_app.benches import plain, synthetic

    parameters, site = Parameters(), synthetic.observations(size)
    associate(site[:100], parameters)  # what is imported at the first use is no part of it
    ours_s, labels = cpu_s(lambda: associate(site, parameters), times=3 if size <= 5000 else 1)
    row = {
        "observations": size,
        "points": sum(o.n for o in site),
        "objects": len(np.unique(labels)),
        "cpu_s": round(ours_s, 4),
        "us_per_observation": round(1e6 * ours_s / size, 1),
        "peak_mb": peak_mb(),
    }
    if size > plain_up_to:
        return row | beside_plain(ours_s, None, None)
    plain_s, roots = cpu_s(lambda: plain.associate(site, parameters))
    return row | beside_plain(ours_s, plain_s, _same(labels, np.array(roots)))


def _same(one: Array, other: Array) -> bool:
    """Two labellings of one partition."""
    pairs = len(set(zip(one.tolist(), other.tolist(), strict=True)))
    return pairs == len(set(one.tolist())) == len(set(other.tolist()))


def _line(row: dict[str, Any]) -> str:
    return (
        f"{row['observations']} observations, {row['objects']} objects: {row['cpu_s']:.3g} s of CPU "
        f"({row['us_per_observation']:.0f} us each), {row['peak_mb']} MB at most; {said(row)}"
    )
