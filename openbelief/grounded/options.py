"""Every number of the grounded readout. None is one of `Parameters`: they only say how a frozen memory is read."""

from __future__ import annotations

import dataclasses
from typing import Annotated, Any, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from openbelief.pieces import COSINE, RADIUS_M
from openbelief.settings import CHECKED, Cosine, Fraction, Number, Positive, in_one_line

NotNegative = Annotated[Number, Field(ge=0)]


@in_one_line("Grounded option")
@dataclass(frozen=True, kw_only=True, config=CHECKED)
class GroundedOptions:
    """docs/answers.md says which of these were measured, and on what. Raises ValueError on a value out of range."""

    # Fragments of one object, pooled at read time
    fragment_overlap: Fraction = 0.3  # the larger directed share of points within `fragment_radius_m`
    fragment_radius_m: Positive = RADIUS_M  # with these two the memory's file knows the pairs already
    fragment_cosine: Cosine = COSINE  # <f_i^v, f_j^v>

    # Belief over phrases: p ~ (V + prior)^power exp(gain <g_p, f^v>); without the gain where features are not aligned
    support_prior: Positive = 0.5
    support_power: Positive = 0.5
    visual_gain: NotNegative = 10.0

    # Names of the thing, beside its own words
    synonym_cost: NotNegative = 0.1
    kind_cost: NotNegative = 0.15
    other_cost: NotNegative = 0.1  # off the likeness of a phrase that is known to name another thing

    # Thing: S = language_share z(H) + (1 - language_share) z(<f^v, q>) - evidence_cost / sqrt(looks)
    temperature: Positive = 0.1  # of the log-sum-exp over phrases
    consensus_share: Fraction = 0.5  # of H; the rest is the log-sum-exp
    language_share: Fraction = 0.8
    language_spread: Positive = 0.05  # the least standard deviation of H over a map: alike things stay alike
    visual_spread: Positive = 0.03
    evidence_cost: NotNegative = 0.5
    looks: Literal["observations", "frames", "moments"] = "observations"
    moment_s: Positive = 0.5  # looks closer in time than this are one, where `looks` counts moments
    colour_weight: NotNegative = 1.0
    colour_prior: Positive = 5.0  # evidence w_e of no colour

    # Place: rooms that were given are hard, derived ones and those inferred from what stands around are soft
    given_weight: NotNegative = 5.0
    derived_weight: NotNegative = 2.0
    inferred_weight: NotNegative = 1.5
    room_slack_m: NotNegative = 0.25  # an object whose centroid lies in a wall belongs to the room beside it
    place_floor: Positive = 0.05  # added to the probability of a place: what stands around never rules out
    place_radius_m: Positive = 2.0
    place_temperature: Positive = 0.2

    # Relations: + relation_weight log(floor + sum_a P_a nearness), P = softmax(S_anchor / anchor_temperature)
    relation_weight: NotNegative = 1.0
    relation_floor: Positive = 0.01
    anchor_temperature: Positive = 0.3
    near_m: Positive = 0.5
    nearest_m: Positive = 1.0
    touch_m: Positive = 0.1
    height_m: Positive = 0.15
    between_m: Positive = 0.5

    # Which one, and what it is not
    fit_margin: Fraction = 0.25  # below the best H: still one of the things that were asked for
    not_weight: NotNegative = 5.0

    # Doubt, by the best candidate's H; None: the text encoder's own (grounded/levels.py)
    found_at: Cosine | None = None
    unsure_at: Cosine | None = None
    related_at: Fraction = 0.05  # a relation's value below which it does not hold
    contradicted_at: Fraction | None = 0.9  # share of what is said of an attribute that denies it; None: never doubted

    # Arrival (`arrival_check = "relative"`)
    arrival_share: NotNegative = 1.0  # what is seen from near counts at least this share of what the map says
    arrival_visual_gain: NotNegative = 5.0  # of <f_mask, p> beside <g_phrase, p>, where what was seen is named

    def to_dict(self) -> dict[str, Any]:
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> GroundedOptions:
        """Raises ValueError naming an unknown key."""
        return cls(**values)
