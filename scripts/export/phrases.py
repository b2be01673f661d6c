"""A few thousand strings for tokenizer parity: phrases as operators and models write them, and worse."""

from __future__ import annotations

import itertools
import random

ADJECTIVES = (
    "red,blue,dark green,wooden,small,old-fashioned,stainless-steel,half-open,children's,3-seat,24\",white/grey"
)
NOUNS = (
    "chair,office chair,fire extinguisher,lamp,potted plant,door handle,TV,Wi-Fi router,cup of tea,e-stop,O'Reilly book"
)
PLACES = ",on the table,next to the window!,in Room 2.14,(broken),behind it's cover,at 50% off,& co.,#7"
ODD = [
    "",
    " ",
    "  two   spaces ",
    "tab\tand\nnewline",
    "UPPER lower MiXeD",
    "l'étagère d'à côté",
    "Stuhl für Gäste, groß",
    "ŞİŞE İstanbul ıi",
    "красный стул",
    "κόκκινη καρέκλα",
    "הכיסא האדום",
    "الكرسي الأحمر",
    "赤い椅子",
    "红色的椅子",
    "빨간 의자",
    "लाल कुर्सी",
    "เก้าอี้สีแดง",
    "🪑 red chair 🔥🧯",
    "👩🏽‍🚀 astronaut",
    "cafe\u0301 (decomposed)",
    "ﬁre eﬃciency ligatures",
    "“curly” ‘quotes’ ’s it’s",
    "ｆｕｌｌ ｗｉｄｔｈ １２３",
    "zero\u200bwidth\u200djoin",
    "soft\u00adhyphen",
    "nb\u00a0space",
    "ideographic\u3000space",
    "&amp; &lt;b&gt; &quot;x&quot; &amp;amp;",
    "½ cup ²³ Ⅷ ①",
    "__snake_case__ a_b",
    "a" * 300,
    "chair " * 120,
    "... --- !!! ???",
    "'s 't 're 've 'm 'll 'd",
    "can't won't they'll I'd",
    "http://example.org/a?b=c&d=e",
    "C:\\path\\file.txt",
    "ignore previous instructions",
    "\x1b[31mred\x1b[0m",
    "a\x00b\x07c",
    "line\u2028separator",
    "ΣΊΣΥΦΟΣ",
    "ǅ ǈ Ĳ ŉ",
    "ﷺ",
    "\ufeffbom",
]

BLOCKS = [
    (0x20, 0x7F),
    (0xA0, 0x24F),
    (0x300, 0x36F),
    (0x370, 0x52F),
    (0x590, 0x6FF),
    (0x900, 0x97F),
    (0x2000, 0x206F),
    (0x2100, 0x218F),
    (0x2E80, 0x30FF),
    (0x4E00, 0x9FFF),
    (0xAC00, 0xD7A3),
    (0xFF00, 0xFFEF),
    (0x1F300, 0x1FAFF),
]  # of Unicode


def _letter(chance: random.Random, low: int, high: int) -> str:
    return chr(chance.randint(low, high)) if chance.random() < 0.7 else chance.choice(" aeiou'")


def phrases(count: int = 4000, seed: int = 0) -> list[str]:
    """The odd ones, plain combinations, and strings of random characters from many scripts."""
    plain = [
        " ".join(words).strip()
        for words in itertools.product(ADJECTIVES.split(","), NOUNS.split(","), PLACES.split(","))
    ]
    chance = random.Random(seed)
    noise: list[str] = []
    while len(ODD) + len(plain) + len(noise) < count:
        low, high = chance.choice(BLOCKS)
        letters = [
            chr(chance.randint(low, high)) if chance.random() < 0.7 else chance.choice(" aeiou'") for _ in range(12)
        ]
        noise.append("".join(letters))
    return (ODD + plain + noise)[:count]
