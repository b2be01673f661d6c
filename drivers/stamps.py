"""Stamps of another machine's clock: the data's age, whether it is new, whether that clock was set."""

from __future__ import annotations

from drivers.ports import ANY_AGE_S, StaleData

AHEAD_S = 0.25  # a stamp further in the future means that the clocks differ
SET_BACK_NS = 1_000_000_000  # messages overtake each other by less; older by more: that clock was set back


def set_back(stamp_ns: int, newest_ns: int) -> bool:
    """Whether the sender's clock was set back since its newest stamp; what it said before says nothing any more."""
    return stamp_ns < newest_ns - SET_BACK_NS


def is_news(stamp_ns: int, newest_ns: int) -> bool:
    """Newer than the newest so far, or the first after the sender's clock was set back."""
    return stamp_ns > newest_ns or set_back(stamp_ns, newest_ns)


OTHERS_CLOCK = "synchronise the clocks (chrony); if they were just now, begin this program anew."
OWN_CLOCK = "did the system clock jump?"


def require_fresh(
    what: str, stamp_ns: int, now_ns: int, max_age_s: float, trouble: str = "", *, ahead: str = OTHERS_CLOCK
) -> None:
    """Raises StaleData where the stamp is older than `max_age_s`, or in the future: then nobody knows how old it is.

    From ANY_AGE_S on, age is not asked for, and a stamp in the future is no reason either. ahead: what to do then.
    """
    age_s = (now_ns - stamp_ns) / 1e9
    if age_s > max_age_s:
        raise StaleData(f"{what}: the newest is {age_s:.2f} s old, more than {max_age_s:g} s.{trouble}")
    if age_s < -AHEAD_S and max_age_s < ANY_AGE_S:
        raise StaleData(f"{what}: its stamp is {-age_s:.2f} s ahead of our clock: {ahead}")
