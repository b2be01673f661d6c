"""The things of a random site and what people call them.

The names are those of the LVIS v1 categories (CC BY 4.0, lvisdataset.org): written by others, for other ends. None of
the development recordings' labels is among the things that are asked for; the pieces by which people know a room (a
bed, a toilet) are the same everywhere, stand there too, and are not asked for. Rooms, sizes and what a camera takes a
thing for are ours.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

ROOMS = {
    "K": "kitchen",
    "B": "bathroom",
    "D": "bedroom",
    "L": "living room",
    "O": "office",
    "H": "hallway",
    "N": "dining room",
    "C": "kids room",
    "W": "laundry room",
    "S": "study",
    "G": "garage",
    "Y": "balcony",
    "T": "storage room",
    "E": "entrance",
}

# names, the first is the label | rooms | width, depth, height (m) | kinds | taken for | stands on
_THINGS = """
stove/kitchen stove/range/kitchen range/cooking stove | K | .6 .6 .9 | kitchen appliance | dishwasher |
dishwasher/dishwashing machine | K | .6 .6 .85 | kitchen appliance, appliance | stove |
ice maker | K | .5 .6 .8 | kitchen appliance, appliance | dishwasher |
kitchen table | K N | 1.3 .8 .75 | table, furniture | desk |
highchair/feeding chair | K N | .55 .55 1.0 | chair, seat | stool |
stool | K N G | .35 .35 .5 | seat | box |
cooler/ice chest | K G Y | .6 .4 .4 | container | suitcase |
water jug | K O | .3 .3 .5 | container | bottle |
coffee maker/coffee machine | K O | .25 .3 .35 | kitchen appliance | blender | kitchen table, table
blender/liquidizer/liquidiser | K | .18 .18 .38 | kitchen appliance | coffee maker | kitchen table
mixer/stand mixer | K | .25 .35 .35 | kitchen appliance | sewing machine | kitchen table
toaster oven | K | .45 .35 .28 | kitchen appliance | radio | kitchen table
chopping board/cutting board/chopping block | K | .4 .3 .04 | kitchen utensil | tray | kitchen table
frying pan/frypan/skillet | K | .3 .4 .08 | cookware | plate | stove
pitcher/ewer | K N | .16 .16 .26 | container | vase | kitchen table, table
bread-bin/breadbox | K | .4 .25 .2 | container | box | kitchen table
wine bucket/wine cooler | N L | .22 .22 .26 | container | flowerpot | table
towel rack/towel rail/towel bar | B | .6 .15 1.0 | rack | ladder |
water heater/hot-water heater | B W | .5 .5 1.2 | appliance | barrel |
heater/warmer | B O T | .5 .2 .6 | appliance | radiator |
bath towel | B | .5 .35 .3 | linen | blanket |
first-aid kit | B H | .3 .2 .2 | box | toolbox |
recliner/reclining chair/lounger/lounger chair | L D | .9 .95 1.0 | chair, seat | sofa |
chaise longue/chaise/daybed | L D | 1.7 .7 .8 | seat, furniture | bed |
futon | D C | 1.9 1.2 .35 | bed, furniture | mattress |
mattress | D T | 1.9 .9 .2 | bedding | sofa |
armoire | D | 1.1 .6 2.0 | cabinet, furniture | bookcase |
cupboard/closet | K D H | 1.0 .5 1.8 | cabinet, furniture | bookcase |
footstool/footrest | L D | .5 .4 .4 | seat | box |
ottoman/pouf/pouffe/hassock | L D | .5 .5 .4 | seat | cushion |
trunk | D T C | .9 .5 .5 | box | bench |
table | L N O S D C W | 1.1 .7 .72 | furniture | bench |
alarm clock | D | .16 .1 .16 | clock | radio | trunk, table
oil lamp/kerosene lamp/kerosine lamp | L S | .18 .18 .35 | lamp, light | bottle | table
lantern | Y G | .22 .22 .36 | light | birdcage |
globe | S C O | .35 .35 .5 | decoration | ball | table
typewriter | S O | .4 .35 .2 | office equipment | printer | table
record player/phonograph/turntable | L | .45 .35 .15 | electronics | suitcase | table
radio receiver/radio set/radio/tuner | L K | .35 .14 .22 | electronics | speaker | table, kitchen table
speaker | L | .3 .3 .9 | electronics | subwoofer |
amplifier | L S | .45 .35 .18 | electronics | radio | table
projector | O | .35 .3 .15 | electronics | camera | table
monitor | O S | .6 .2 .45 | screen, electronics | picture | table
microscope | S O | .2 .25 .4 | instrument | camera | table
shredder | O | .35 .25 .5 | office equipment | trash can |
vending machine | O H | .9 .8 1.8 | machine | refrigerator |
air conditioner | O D | .8 .4 .7 | appliance | heater |
bulletin board/notice board | O S H | 1.2 .1 1.5 | board | painting |
blackboard/chalkboard | C O | 1.4 .12 1.6 | board | door |
easel | C S | .7 .6 1.5 | stand | stepladder |
poster/placard | C S | .7 .08 1.0 | picture | painting |
painting | L H | .9 .08 1.0 | picture | poster |
statue | L H Y | .4 .4 1.2 | decoration | lamp |
coatrack/hatrack | H E | .5 .5 1.8 | rack | small tree |
umbrella | E H | .2 .2 .9 | accessory | broom |
mailbox/letter box | E | .4 .3 .5 | box | cabinet |
shoe/sneaker/tennis shoe | E H | .3 .3 .14 | footwear | slipper |
boot | E H | .3 .3 .35 | footwear | bag |
slipper/carpet slipper | D H | .3 .26 .1 | footwear | cushion |
baby buggy/baby carriage/perambulator/pram/stroller | H E G | .6 1.0 1.0 | vehicle | shopping cart |
tricycle | C G | .5 .7 .6 | vehicle, toy | bicycle |
motor scooter/scooter | G | .6 1.6 1.1 | vehicle | bicycle |
wheelchair | H D E | .65 1.0 .95 | chair, seat | shopping cart |
sewing machine | W S | .45 .25 .35 | machine | typewriter | table
ironing board | W | 1.2 .4 .9 | board | bench |
iron/smoothing iron | W | .28 .13 .15 | appliance | shoe | ironing board
bucket/pail | W T G | .3 .3 .3 | container | trash can |
mop | W T | .25 .25 1.2 | cleaning tool | broom |
broom | W T K | .25 .25 1.3 | cleaning tool | pole |
vacuum cleaner | T W H | .35 .4 .9 | appliance | lawn mower |
fan | D O L | .4 .4 1.2 | appliance | floor lamp |
generator | G | .7 .5 .6 | machine | air conditioner |
handcart/pushcart/hand truck | T G | .5 .6 1.1 | cart | chair |
barrow/garden cart/lawn cart/wheelbarrow | G Y | .7 1.2 .6 | cart | bathtub |
lawn mower | G | .5 1.2 1.0 | machine | stroller |
stepladder | T G | .5 .7 1.5 | ladder | easel |
sawhorse/sawbuck | G | .9 .5 .75 | stand | bench |
toolbox | G T | .5 .25 .3 | box | suitcase |
barrel/cask | T G | .5 .5 .85 | container | trash can |
tank/storage tank | G W | .6 .6 1.3 | container | refrigerator |
locker/storage locker | H T | .4 .5 1.8 | cabinet, furniture | wardrobe |
shopping cart | G T | .6 .9 1.0 | cart | cage |
crate | G T K | .5 .35 .3 | container, box | basket |
duffel bag/duffle bag/duffel/duffle | D H | .6 .3 .3 | bag | backpack |
handbag/purse/pocketbook | D E | .35 .2 .3 | bag | basket |
briefcase | S O | .42 .14 .32 | bag | suitcase |
basket/handbasket | K D W | .4 .3 .3 | container | box |
bench | H E Y N | 1.2 .4 .45 | seat, furniture | shelf |
deck chair/beach chair | Y | .6 1.0 .9 | chair, seat | folding chair |
rocking chair | L C Y | .65 .9 1.1 | chair, seat | armchair |
parasol/sunshade | Y | .5 .5 2.0 | umbrella | floor lamp |
flowerpot | L | .35 .35 .35 | container | vase |
watering can | Y | .35 .2 .3 | container | kettle |
hose/hosepipe | G Y | .5 .5 .25 | tool | tire |
birdcage | L Y | .45 .4 .7 | cage | lantern |
aquarium/fish tank | L C | 1.0 .4 .6 | container | television |
fishbowl/goldfish bowl | C L | .3 .3 .3 | container | vase | table
flower arrangement/floral arrangement | N L H | .35 .35 .5 | decoration | salad | table
Christmas tree | L | 1.0 1.0 1.9 | decoration | potted plant |
clock/timepiece/timekeeper | L K H | .3 .12 .3 | decoration | plate | table, kitchen table
piggy bank/penny bank | C | .2 .16 .16 | toy | ball | table, trunk
dollhouse/doll's house | C | .7 .4 .8 | toy | bookcase |
doll | C | .2 .16 .45 | toy | teddy bear |
playpen | C | 1.1 1.1 .75 | furniture | cage |
crib/cot | C D | 1.3 .7 .9 | bed, furniture | sofa |
sled/sledge/sleigh | G C | .5 1.1 .3 | vehicle, toy | bench |
drum | C L | .5 .5 .5 | musical instrument | bucket |
harmonium/organ/reed organ | L C | 1.3 .6 1.1 | musical instrument | desk |
table-tennis table/ping-pong table | G C | 2.2 1.3 .76 | table | desk |
barbell | G D | .3 1.2 .26 | sports equipment | pole |
beachball | C Y | .4 .4 .4 | ball, toy | balloon |
snowboard | T G | .3 .25 1.5 | sports equipment | plank |
surfboard | G T | .5 .2 1.9 | sports equipment | door |
helmet | G E | .3 .26 .26 | headgear | ball |
traffic cone | G | .35 .35 .6 | safety equipment | lamp |
dog | L H | .7 .3 .55 | animal, pet | teddy bear |
rabbit | C | .3 .2 .26 | animal, pet | slipper |
"""

# One of each in every such room; the same columns.
_MARKS = """
refrigerator | K | .65 .65 1.8 | kitchen appliance, appliance | wardrobe |
kitchen sink/sink | K | 1.0 .6 .95 | fixture | washbasin |
toilet | B | .4 .65 .78 | fixture | chair |
washbasin/basin/washbowl/washstand/handbasin | B | .7 .5 .9 | fixture | cabinet |
bathtub/bathing tub | B | 1.7 .78 .56 | fixture | sofa |
bed | D | 1.7 2.1 .6 | furniture | sofa |
wardrobe | D | 1.2 .6 2.0 | cabinet, furniture | bookcase |
sofa/couch/lounge | L | 2.0 .9 .8 | seat, furniture | bed |
television set/tv/tv set | L | 1.1 .3 .8 | screen, electronics | monitor |
desk | O S | 1.4 .7 .74 | table, furniture | table |
printer/printing machine | O | .45 .4 .35 | office equipment | copier |
bookcase | S L | 1.1 .32 1.8 | shelf, furniture | wardrobe |
dining table | N | 1.6 .9 .75 | table, furniture | desk |
bunk bed | C | 1.0 2.0 1.6 | bed, furniture | shelf |
teddy bear | C | .35 .3 .4 | toy | dog |
automatic washer/washing machine | W | .6 .6 .85 | appliance | dishwasher |
motorcycle | G | .8 2.0 1.1 | vehicle | bicycle |
flowerpot | Y | .35 .35 .35 | container | vase |
box | T | .5 .4 .4 | container | suitcase |
doormat/welcome mat | E H | .8 .5 .03 | rug | rug |
"""

# LVIS names of things that stand at no such site.
ELSEWHERE = tuple(
    " ".join(row.split())
    for row in """
airplane, ambulance, armor, ashtray, axe, bagpipe, banjo, baseball bat, bedpan, binoculars, birdbath, bow-tie,
bulldozer, bullhorn, camcorder, canoe, cash register, cassette, chessboard, clarinet, colander, combination lock,
cowbell, crowbar, crutch, cymbal, dartboard, dish antenna, drone, dumpster, eggbeater, fire hose, fishing rod,
flashlight, football helmet, forklift, gargoyle, gasmask, golf club, gravestone, hammer, hammock, handcuff, handsaw,
hockey stick, horse carriage, ice skate, jewelry, kayak, kite, lab coat, life buoy, life jacket, machine gun, manhole,
oar, parachute, parking meter, pitchfork, plow, propeller, puppet, rifle, roller skate, router, saddle, saxophone,
scarecrow, scoreboard, skateboard, sombrero, steering wheel, stop sign, streetlight, sword, syringe, tambourine,
telephone booth, thermometer, tiara, tractor, traffic light, turban, unicycle, volleyball, windmill, wind chime,
wrench, wreath, yoke
""".replace("\n", " ").split(",")
)


@dataclass(frozen=True)
class Thing:
    """names: the first is the label. rooms: their names. size_m: width, depth, height. stands_on: labels, or none."""

    names: tuple[str, ...]
    rooms: tuple[str, ...]
    size_m: tuple[float, float, float]
    kinds: tuple[str, ...]
    taken_for: str
    stands_on: tuple[str, ...]

    @property
    def label(self) -> str:
        return self.names[0]

    @property
    def words(self) -> frozenset[str]:
        """Everything that it may be called."""
        return frozenset((*self.names, *self.kinds, self.taken_for))


@cache
def things() -> dict[str, Thing]:
    """What is asked for, by label."""
    return {thing.label: thing for thing in map(_parsed, _THINGS.strip().splitlines())}


@cache
def marks() -> tuple[Thing, ...]:
    """The pieces by which people know a room."""
    return tuple(map(_parsed, _MARKS.strip().splitlines()))


def _parsed(line: str) -> Thing:
    names, rooms, size, kinds, taken_for, stands_on = (part.strip() for part in line.split("|"))
    w, d, h = map(float, size.split())
    return Thing(
        tuple(names.split("/")),
        tuple(ROOMS[letter] for letter in rooms.split()),
        (w, d, h),
        _listed(kinds),
        taken_for,
        _listed(stands_on),
    )


def _listed(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(",") if part.strip())
