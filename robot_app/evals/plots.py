"""The curves of evaluations, as pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def plot_doubt(result: dict[str, Any], path: Path) -> None:
    """Kept of the findable and refused of the absent nouns, over the level from which a thing counts as found."""
    from matplotlib.figure import Figure

    doubt, absent = result["doubt"], result.get("absent_nouns")
    levels = [point["found_at"] for point in doubt["curve"]]
    figure = Figure(figsize=(7, 4.2), layout="constrained")
    axes = figure.subplots()
    axes.plot(levels, [point["kept"] for point in doubt["curve"]], color="#1b7f4b", label="kept of the findable")
    if absent:
        refused = [point["refused"] for point in doubt["curve"]]
        axes.plot(levels, refused, color="#b03a2e", label=f"refused of {absent['queries']} absent nouns")
    axes.axvline(doubt["found_at"], color="#555555", linestyle="--", linewidth=1, label="in use")
    axes.set(xlabel="found at: least likeness H of the best candidate", ylabel="share", ylim=(0, 1.03))
    axes.set_title(f"{Path(result['truth']).name}: {result['queries']} findable queries", loc="left", fontsize=10)
    axes.grid(alpha=0.3)
    axes.legend(loc="lower left", frameon=False)
    figure.savefig(path, dpi=130)


def plot_verification(result: dict[str, Any], path: Path) -> None:
    """Right candidates confirmed over wrong ones confirmed, as each check's threshold moves."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.5, 4.8), layout="constrained")
    for axes, kind in zip(figure.subplots(1, 2, sharey=True), ("wrong", "unmapped"), strict=True):
        for name, color in (("paper", "#b03a2e"), ("relative", "#1b7f4b")):
            curve, check = result["curves"][name], result["checks"][name]
            axes.plot([p[kind] for p in curve], [p["true"] for p in curve], color=color, marker=".", label=name)
            used = ([check[kind]["confirmed"]], [check["true"]["confirmed"]])
            axes.plot(*used, color=color, marker="o", markersize=9, linestyle="none")
        told = "wrong candidates confirmed" + (", the right thing not on the map" if kind == "unmapped" else "")
        axes.set(xlabel=told, xlim=(-0.02, 0.62), ylim=(0, 1.02))
        axes.grid(alpha=0.3)
        axes.legend(loc="lower right", frameon=False)
    figure.axes[0].set_ylabel("right candidates confirmed")
    figure.suptitle(
        f"{Path(result['truth']).name}: large dots are the thresholds in use", fontsize=10, x=0.01, ha="left"
    )
    figure.savefig(path, dpi=130)
