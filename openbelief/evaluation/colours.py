"""Queries for things in their own colour, and in one that none of their name has: what doubt keeps and refuses."""

from __future__ import annotations

from openbelief.evaluation.truth import Truth


def coloured_queries(truth: Truth) -> tuple[list[str], list[str]]:
    """For every label of which a colour is known: "red chair" where one is, "blue chair" where none is.

    The colour that none has is the next one of the truth's own, from another place for every label.
    """
    of_label: dict[str, set[str]] = {}
    for thing in truth.objects.values():
        if thing.colour is not None:
            of_label.setdefault(thing.label, set()).add(thing.colour)
    known = sorted(set().union(*of_label.values()))
    own, other = [], []
    for k, (label, colours) in enumerate(sorted(of_label.items())):
        turned = [*known[k % len(known) :], *known[: k % len(known)]]
        strange = next((colour for colour in turned if colour not in colours), None)
        own.append(f"{min(colours)} {label}")
        other += [] if strange is None else [f"{strange} {label}"]
    return own, other
