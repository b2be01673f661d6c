"""What a sentence asks for, in parts; nothing that it says is dropped."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from openbelief.request import parse
from openbelief.target_phrase import target_phrase

UNDERSTOOD = [
    ("take me to the red chair in the kitchen, please", {"target": "red chair", "place": "kitchen"}),
    ("I need the lamp, thank you very much", {"target": "lamp"}),
    ("Where did I leave my keys?", {"target": "keys"}),
    ("could you be so kind and bring me to the lamp", {"target": "lamp"}),
    ("in the kitchen, find the lamp", {"target": "lamp", "place": "kitchen"}),
    ("in the kitchen find the lamp", {"target": "lamp", "place": "kitchen"}),
    ("the ball which is in the kids room", {"target": "ball", "place": "kids room"}),
    ("the plant on the balcony", {"target": "plant", "place": "balcony"}),
    ("the plant at the entrance", {"target": "plant", "place": "entrance"}),
    ("the desk with the telephone on it", {"target": "desk", "relation": "with telephone on it"}),
    ("the lamp on the desk", {"target": "lamp", "relation": "on desk"}),
    ("the book lying on the floor", {"target": "book", "relation": "on floor"}),
    ("the box underneath the desk", {"target": "box", "relation": "under desk"}),
    ("the chair by the window", {"target": "chair", "relation": "next to window"}),
    ("the umbrella in front of the door", {"target": "umbrella", "relation": "in front of door"}),
    ("the lamp to the left of the sofa", {"target": "lamp", "relation": "left of sofa"}),
    ("the table nearest to the bin", {"target": "table", "relation": "nearest to bin"}),
    ("nearest lamp to the sofa", {"target": "lamp", "relation": "nearest to sofa"}),
    ("the sink between the stove and the fridge", {"target": "sink", "relation": "between stove and fridge"}),
    (
        "the chair next to the table with the lamp on it",
        {"target": "chair", "relation": "next to table with lamp on it"},
    ),
    (
        "the cup that is on the table in the kitchen next to the sink",
        {"target": "cup", "place": "kitchen", "relation": "on table; next to sink"},
    ),
    ("what is on the table?", {"target": "something", "relation": "on table"}),
    ("the nearest chair", {"target": "chair", "which": "nearest"}),
    ("the lamp next to me", {"target": "lamp", "which": "nearest"}),
    ("is there a toilet nearby", {"target": "toilet", "which": "nearest"}),
    ("the second largest chair", {"target": "chair", "which": "second largest"}),
    ("the chair that is the largest", {"target": "chair", "which": "largest"}),
    ("the third chair", {"target": "chair", "which": "third"}),
    ("the last chair", {"target": "chair", "which": "last"}),
    ("the other chair", {"target": "chair", "which": "other"}),
    ("the left-most lamp", {"target": "lamp", "which": "left-most"}),
    ("the second lamp from the right", {"target": "lamp", "which": "second right-most"}),
    ("chair, not the red one", {"target": "chair", "not": "red chair"}),
    ("the office chair which is not blue", {"target": "office chair", "not": "blue chair"}),
    ("not the red chair, the blue one", {"target": "blue chair", "not": "red chair"}),
    ("the mug but not the one in the kitchen", {"target": "mug", "not": "in kitchen"}),
    ("chair but not in the kitchen", {"target": "chair", "not": "in kitchen"}),
    ("any chair except the armchair", {"target": "chair", "not": "armchair"}),
    ("the table without a lamp", {"target": "table", "not": "with lamp"}),
    ("the table with no lamp on it", {"target": "table", "not": "with lamp on it"}),
    ("the chair, the blue one", {"target": "blue chair"}),
    ("the red, wooden chair", {"target": "red wooden chair"}),
    ("a chair in blue", {"target": "blue chair"}),
    ("take me to the lamp and then to the chair", {"target": "lamp", "unused": ["and", "then", "to", "chair"]}),
    ("go to the lamp quickly", {"target": "lamp", "unused": ["quickly"]}),
    ("bring the ball to the kitchen", {"target": "ball", "unused": ["to", "kitchen"]}),
    ("two chairs", {"target": "chairs", "unused": ["two"]}),
    # what a thing is for, wherever the sentence goes on
    ("something to sit on next to the table", {"target": "something to sit on", "relation": "next to table"}),
    ("something to sit on in the kitchen", {"target": "something to sit on", "place": "kitchen"}),
    ("something on which I can sit", {"target": "something to sit on"}),
    ("where can I sit down?", {"target": "something to sit down"}),
    ("what can I sit on?", {"target": "something to sit on"}),
    ("I need to wash my hands", {"target": "something to wash my hands"}),
    # where it is told first
    ("next to the bed, the lamp", {"target": "lamp", "relation": "next to bed"}),
    ("in the office something to write on", {"target": "something to write on", "place": "office"}),
    ("with the lamp on it, the desk", {"target": "desk", "relation": "with lamp on it"}),
    ("in the kitchen, next to the sink, a cup", {"target": "cup", "place": "kitchen", "relation": "next to sink"}),
    ("in front of the sofa", {"target": "something", "relation": "in front of sofa"}),
    # relations
    ("the lamp over the table", {"target": "lamp", "relation": "above table"}),
    ("the lamp on the sofa's left", {"target": "lamp", "relation": "left of sofa"}),
    ("the lamp on the right hand side of the sofa", {"target": "lamp", "relation": "right of sofa"}),
    ("the table which is closest to the sofa", {"target": "table", "relation": "nearest to sofa"}),
    ("the second nearest chair to the door", {"target": "chair", "relation": "nearest to door", "which": "second"}),
    ("the chair far away from the sofa", {"target": "chair", "relation": "farthest from sofa"}),
    ("the chair not far from the sofa", {"target": "chair", "relation": "next to sofa"}),
    ("the lamp next to the sofa and the piano", {"target": "lamp", "relation": "next to sofa; next to piano"}),
    (
        "the chair two meters from the sofa",
        {"target": "chair", "relation": "next to sofa", "unused": ["two", "meters"]},
    ),
    ("what stands next to the bed?", {"target": "something", "relation": "next to bed"}),
    ("the chair next to", {"target": "chair", "unused": ["next", "to"]}),
    # which one
    ("the first chair", {"target": "chair", "which": "first"}),
    ("the bigger box", {"target": "box", "which": "largest"}),
    ("the left chair", {"target": "chair", "which": "left-most"}),
    ("the next chair", {"target": "chair", "which": "other"}),
    ("one more chair", {"target": "chair", "which": "other"}),
    ("the chair behind me", {"target": "chair", "which": "behind"}),
    ("the chair left of me", {"target": "chair", "which": "left-most"}),
    ("a couple of books", {"target": "books"}),
    ("the only piano", {"target": "piano"}),
    # what it is not
    ("the desk that doesn't have a lamp", {"target": "desk", "not": "with lamp"}),
    ("a lamp which does not stand on a desk", {"target": "lamp", "not": "on desk"}),
    (
        "the plant that is neither in the kitchen nor in the bedroom",
        {"target": "plant", "not": "in kitchen; in bedroom"},
    ),
    ("any lamp but the desk lamp", {"target": "lamp", "not": "desk lamp"}),
    ("not the sofa but the armchair", {"target": "armchair", "not": "sofa"}),
    ("don't go to the sofa, go to the armchair", {"target": "armchair", "not": "sofa"}),
    ("do not take me to the sofa but to the armchair", {"target": "armchair", "not": "sofa"}),
    ("not this chair, the other one", {"target": "chair", "which": "other"}),
    ("the non-red chair", {"target": "chair", "not": "red chair"}),
    ("the chair outside the kitchen", {"target": "chair", "not": "in kitchen"}),
    (
        "not the lamp on the desk but the one on the nightstand",
        {"target": "lamp", "relation": "on nightstand", "not": "on desk"},
    ),
    # places that no room is called
    ("the lamp upstairs", {"target": "lamp", "place": "upstairs"}),
    ("the chair in here", {"target": "chair", "place": "here"}),
    ("the plant in this room", {"target": "plant", "place": "this room"}),
    ("the biggest plant in the house", {"target": "plant", "which": "largest"}),
    ("the lamp over there", {"target": "lamp", "unused": ["over", "there"]}),
    ("the lamp, over there", {"target": "lamp", "unused": ["over", "there"]}),
    ("the chair, the left one", {"target": "chair", "which": "left-most"}),
    ("the chair, the second largest", {"target": "chair", "which": "second largest"}),
    ("the chair, the other red one", {"target": "red chair", "which": "other"}),
    # colours said behind the thing, and shades
    ("the ball that is orange", {"target": "orange ball"}),
    ("the reddish chair", {"target": "red chair"}),
    ("something red on the desk", {"target": "something red", "relation": "on desk"}),
    ("a chair, preferably red", {"target": "red chair"}),
    # alternatives, and any room
    ("a chair or a sofa in the kitchen or the office", {"target": "chair or sofa", "place": "kitchen or office"}),
    ("either a chair or a sofa", {"target": "chair or sofa"}),
    ("a chair in any room", {"target": "chair"}),
    # questions
    ("where in the kitchen is the microwave?", {"target": "microwave", "place": "kitchen"}),
    ("which room is the piano in?", {"target": "piano"}),
    ("what is the thing next to the fridge called", {"target": "thing", "relation": "next to fridge"}),
    ("I lost my backpack, can you help me find it?", {"target": "backpack"}),
    ("wheres teh cat", {"target": "cat"}),
    # another wish, or a reason
    ("the lamp, quick!!! there is a fire", {"target": "lamp", "unused": ["quick", "there", "is", "fire"]}),
    ("take me to the lamp, it's urgent", {"target": "lamp", "unused": ["it's", "urgent"]}),
    ("the lamp; and hurry up", {"target": "lamp", "unused": ["hurry", "up"]}),
    # the words around a noun of another language
    ("Wo ist der Kühlschrank?", {"target": "kühlschrank"}),
    ("¿Dónde está la nevera?", {"target": "nevera"}),
    ("der Stuhl", {"target": "stuhl"}),
]
# Every way of asking here is for the lamp, and for nothing else.
MANNERS = [
    *("please, the lamp", "the lamp, please", "please take me to the lamp please", "thanks, the lamp", "lamp pls"),
    *("could you please, if you don't mind, take me to the lamp", "the lamp, my dear", "the lamp, my friend, please"),
    *("hey robot, take me to the lamp, would you?", "dear robot, the lamp, if possible", "sorry, I meant the lamp"),
    *("excuse me, where is the lamp?", "hi there, find the lamp", "um, the lamp", "uh, take me, please, to the lamp"),
    *("take me to, please, the lamp", "I would be grateful if you took me to the lamp", "lead the way to the lamp"),
    *("would it be possible to go to the lamp", "can we go to the lamp now", "do you know where the lamp is?"),
    *("any idea where the lamp is", "tell me where I can find the lamp", "where on earth is the lamp", "THE LAMP!!!"),
    *("please be so kind as to bring me to the lamp", "meet me at the lamp", "and the lamp?", "drive me to the lamp"),
]
NAMES = [
    *("love seat", "walk in closet", "show case", "umbrella stand", "top shelf", "tv stand", "tin can", "light"),
    *("first aid kit", "robot vacuum", "no smoking sign", "small table", "chair to sit on", "something to drink from"),
    *("salt and pepper shaker", "stop sign", "loudspeaker", "go-kart", "painting of a cat", "stuhl", "silla", "椅子"),
]


@pytest.mark.parametrize(("sentence", "parts"), UNDERSTOOD, ids=[sentence for sentence, _ in UNDERSTOOD])
def test_a_sentence_is_understood_in_parts(sentence, parts):
    nothing = {"place": None, "relation": None, "which": None, "not": None, "unused": []}
    assert parse(sentence).as_json() == nothing | parts


@pytest.mark.parametrize("sentence", MANNERS)
def test_manners_around_a_request_say_nothing_of_the_thing(sentence):
    nothing = {"place": None, "relation": None, "which": None, "not": None, "unused": []}
    assert parse(sentence).as_json() == nothing | {"target": "lamp"}


@pytest.mark.parametrize("name", NAMES)
def test_a_name_that_holds_such_words_stays_a_name(name):
    request = parse(f"take me to the {name}")
    assert request.target == name and not (request.place or request.relations or request.which or request.negations)


def test_the_sentence_and_what_the_papers_readouts_embed_stay_unchanged():
    sentence = "Take me to the red chair in the kitchen, please."
    request = parse(sentence)
    assert request.sentence == sentence and request.text == target_phrase(sentence).text == "red chair in the kitchen"


def test_it_and_the_other_one_are_what_was_asked_for_before():
    before = parse("take me to the red chair")
    other = parse("the other one", before)
    assert (other.sentence, other.text) == ("the other one", "red chair")
    assert (other.target, str(other.which)) == ("red chair", "other")
    assert parse("take me to it", before).target == "red chair"
    assert parse("no, the blue one", before).target == "blue chair"
    assert str(parse("not that one", before).which) == "other"


def test_everything_that_must_be_compared_is_named_once():
    request = parse("the chair next to the table with the lamp on it, not the chair next to the sofa")
    assert set(request.phrases) >= {"chair", "table", "lamp"} and len(set(request.phrases)) == len(request.phrases)


@pytest.mark.parametrize(
    "sentence",
    [
        "",
        "  ",
        "?!",
        "take me to the",
        "please",
        "lamp " * 100,
        "of",
        "yes",
        "thank you",
        "next to",
        "who are you",
        "🪑",
    ],
)
def test_a_sentence_that_names_nothing_is_refused_in_one_line(sentence):
    with pytest.raises(ValueError, match=r"^The sentence [^\n]*$"):
        parse(sentence)


OWN_WORDS = (
    "the a chair red not in on next to kitchen between and with it largest second other one of left from without that "
    "is , nearest me then no"
)
WORDS = st.sampled_from(OWN_WORDS.split(" "))


@given(st.lists(WORDS, min_size=1, max_size=14))
@settings(max_examples=300, deadline=None)
def test_any_order_of_the_parsers_own_words_ends_in_a_request_or_a_refusal(words):
    try:
        request = parse(" ".join(words))
    except ValueError:
        return
    assert request.target.strip() and all(anchor.strip() for r in request.every_relation for anchor in r.anchors)


@given(st.text(max_size=400))
@settings(max_examples=200, deadline=None)
def test_any_text_ends_in_a_request_or_a_refusal(sentence):
    try:
        request = parse(sentence)
    except ValueError:
        return
    assert request.target.isprintable() and request.sentence == sentence


@pytest.mark.parametrize("words", ["next to ", "please, ", "that is ", "not ", "and the ", "if you can "])
def test_words_said_over_and_over_end_in_a_thing(words):
    """A pattern that runs away would not come back within a lifetime."""
    sentence = words * (280 // len(words)) + "lamp"
    assert parse(sentence).sentence == sentence
