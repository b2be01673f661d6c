"""An operator's sentence made plain: one line of lower-case words, without who is spoken to and without politeness."""

from __future__ import annotations

import re

from openbelief.phrase import clean
from openbelief.target_phrase import ARTICLES, LEADING, MAX_CHARACTERS, QUOTES

LETTERS_MAX = MAX_CHARACTERS * 4  # more than this is not even looked at
EDGES = " .,;:!?\u00bf\u00a1`()[]{}<>-_*"
POLITE = (
    r"please|pls|plz|kindly|thanks|thank you(?: very much| so much)?|thanks a lot|many thanks|cheers|for me|for us|"
    r"if you (?:can|could|would|please|like|don't mind|do not mind|are able)|if possible|when you can|now|okay|ok|"
    r"would you|will you|could you|can you|my friend|dear robot|robot|excuse me|sorry|gone|"
    r"good (?:morning|afternoon|evening)"
)
HURRIED = r"right now|quickly|at once|immediately|asap|right away|again"
CALLED = rf"(?:hey|hi|hello|so|um|uh|{POLITE}|{HURRIED})"
OPENING = re.compile(rf"^(?:{CALLED}(?=[\s,!.]|$)[\s,!.]*)+")
CLOSING = re.compile(rf"(?:[\s,!.]+(?:{POLITE}))+$")
CLOSING_COMMAND = re.compile(rf"(?:[\s,!.]+{CALLED})+$")
# More ways to ask for a thing than the paper's target phrase strips; what consensus embeds stays as it was.
NAMED = r"(?=the |my |our |a |an )"
WAYS = (
    r"where (?:did|do|have|has) (?:i|we|you|he|she|they|somebody|someone) (?:leave|put|left|see|saw|seen|keep)",
    r"where (?:can|could|do|would|might|will) (?:i|we|you) (?:find|get|see)|where (?:might|could|would|should)",
    r"(?:have|did) you (?:seen|see|found|find)|i (?:can't|cannot|can not|could not|couldn't) find|i(?:'ve| have)? lost",
    r"(?:do|does) (?:we|you|anybody|anyone) have|is there|are there|we need|we want|we are looking for|i require",
    r"(?:give|hand|pass|fetch|get|bring|buy|pick) (?:me|us)|pick up|check(?: on| out| for)?|inspect|i could use",
    r"be so (?:kind|good|nice)(?: and| as to| to)?|which (?=\w+ is )|make your way to|head over to|proceed to|approach",
    r"(?:go|walk|drive|come) back to|(?:could|can|may) (?:i|we) have|what about|how about|i wonder where|i'm after",
    r"(?:drive|walk|go|navigate|move|run|come)(?: with me)? (?:up to|towards|toward|to|over to|near|by|past)",
    rf"(?:carry|take|move|push|open|close|clean|water|feed|switch on|switch off|turn on|turn off|put|throw) {NAMED}",
    rf"(?:hold|bring) {NAMED}|what(?: is|'s| are|'re)|which(?: one)? is|who is|you should (?:go to|find|see)",
    r"i(?: would|'d)? (?:like|love|wish|prefer)(?: to (?:see|go to|find|visit|have|get|use|reach|be at))?",
    rf"(?:to|at|near|towards) {NAMED}|(?:meet|join) (?:me|us) (?:at|by|near|next to)|(?:stand|park) (?:at|by) {NAMED}",
    # The encoder knows nouns of other languages; these few words around them say nothing to it.
    r"wo (?:ist|sind|steht|finde ich)|(?:bring|f\u00fchr|fahr|geh)e?(?: mich)? (?:zum|zur|zu)|zeig(?:e)? mir|ich suche",
    r"d\u00f3nde (?:est\u00e1|est\u00e1n|hay)|donde (?:esta|estan|hay)|ll\u00e9vame (?:al|a)|ve (?:al|a)|busca",
    r"o\u00f9 (?:est|sont)|dov'\u00e8|dove (?:\u00e8|sono)",
)
ASKING = re.compile(rf"^(?:{'|'.join(WAYS)})[\s,]*")
FOREIGN = "der|die|das|den|dem|ein|eine|einen|el|la|los|las|un|una|le|les|il|lo|gli"
DETERMINERS = re.compile(rf"^(?:(?:{ARTICLES}|{FOREIGN})(?=[\s,]|$)[\s,]*)+")
HOW = (
    r"(?:very |as |so )?(?:quickly|slowly|carefully|gently|quietly|safely|directly|straight|immediately|fast|asap|soon)"
    r"(?: as (?:you can|possible))?|right away|right now|at once|as soon as possible|hurry(?: up)?|again|today|later"
)
HOW_LAST, HOW_FIRST = re.compile(rf"(?:^|[\s,]+)(?P<how>{HOW}|first)$"), re.compile(rf"^(?P<how>{HOW})[\s,]+")
AND_LAST = re.compile(r"[\s,]+(?:and|but)$")
BE_LAST = re.compile(r"\s(?:is|are|at|be|went|located|kept|around|anywhere|somewhere|here|there|stands|lies|sits)$")

# Words that people say around a request, and that name no thing where a "me", "you" or "is" stands among them.
_ME = "i me you we us they he she it's i'm i'd i'll we're you're let's let would could should might can may will do did"
_AROUND = """
is are am was were be been it there if whether that's to at for about past please thanks thank want wanted need needed
like love wish mean meant think thought know believe wonder wondering hope guess idea clue possible able grateful glad
happy kind nice sorry excuse pardon hello hi hey um uh er erm hmm so oh ah well good morning afternoon evening dear my
friend sir madam mate buddy robot take took taking bring bringing lead leading guide show showing get getting go going
drive driving walk walking find finding locate see look looking search searching visit reach left put saw just maybe
perhaps actually really kindly now where what which how when who not way on tell ask hear have had has must shall don't
mind much very asking speak around over and or ready help too somebody someone anybody time next task job then
"""
ME, AROUND = frozenset(_ME.split()), frozenset((_ME + _AROUND).split()) - {"not", "on", "next"}
ENDS_ASKING = frozenset(["to", "find", "see", "need", "want", "is", "are", "for", "get", "reach", "locate", "visit"])
WHERE = frozenset(["left", "over", "around", "past", "about", "time"])  # alone between commas they say where or which
ARTICLE = re.compile(rf"(?:{ARTICLES})")


def plain(sentence: str) -> str:
    """One line, lower case, quotation marks away, no punctuation at its ends; commas inside stay."""
    unquoted = QUOTES.sub(" ", clean(sentence[:LETTERS_MAX]).replace("\u2019", "'"))
    return " ".join(unquoted.split()).strip(EDGES).lower()


def polished(sentence: str) -> str:
    """`plain`, without the robot's name and politeness at either end; "" where nothing else was said."""
    words = plain(sentence)
    while (shorter := CLOSING_COMMAND.sub("", OPENING.sub("", words)).strip(EDGES)) != words:
        words = shorter
    return "" if re.fullmatch(CALLED, words) else words


def asked_for(text: str) -> tuple[str, tuple[str, ...]]:
    """What is left of a target phrase when further ways of asking, articles and politeness are taken off.

    Second: what it says of the manner ("quickly"), which nothing here can heed.
    """
    words = without_asides(text)
    manner: list[str] = []
    while True:
        shorter = _asked_once(words)
        for pattern in (HOW_LAST, HOW_FIRST):
            if (found := pattern.search(shorter)) and len(found.group()) < len(shorter):
                manner += found["how"].split()
                shorter = AND_LAST.sub("", pattern.sub("", shorter).strip(EDGES))
        if shorter == words:
            return words, tuple(manner)
        words = shorter


def without_asides(words: str) -> str:
    """Without the parts between commas that are all manners: "if you don't mind", "my dear", "excuse me"."""
    parts = [part.strip() for part in words.split(",")]
    kept = [part for part in parts if not _says_nothing(part)]
    return ", ".join(kept) if kept else words


def _says_nothing(part: str) -> bool:
    said = [word for word in part.split() if not ARTICLE.fullmatch(word)]
    if re.fullmatch(f"(?:{POLITE}| )+", part):
        return True
    return bool(said) and AROUND.issuperset(said) and (WHERE.isdisjoint(said) or not ME.isdisjoint(said))


def past_the_asking(words: str) -> str:
    """ "I would be grateful if you took me to THE LAMP": from the first article behind words that only ask.

    Without an article from behind "to", "find" and the like, where somebody is spoken of.
    """
    said = words.replace(",", " , ").split()
    end = next((i for i, word in enumerate(said) if word not in AROUND and word != ","), len(said))
    spoken_of = not ME.isdisjoint(said[:end])
    if end == len(said) or end == 0:
        return words
    if (ARTICLE.fullmatch(said[end]) and end + 1 < len(said)) or (spoken_of and said[end - 1] in ENDS_ASKING):
        return " ".join(said[end:]).replace(" , ", ", ")
    return words


def _asked_once(words: str) -> str:
    words = past_the_asking(CLOSING.sub("", words).strip(EDGES))
    asked = ASKING.sub("", words)
    if asked != words:
        asked = BE_LAST.sub("", asked)
    rest = DETERMINERS.sub("", LEADING.sub("", asked)).strip(EDGES)
    return rest or words
