"""Everyday names of everyday things: which words mean the same, which thing is a kind of which, what a thing is for.

A sentence encoder places "novel" nearer to "bookshelf" than to "book". These rows say what any speaker of English
knows; they were written by hand for homes, offices and workshops, from no dictionary. Only names that can stand for
each other share a row: a blackboard is no whiteboard. A word may stand in two rows ("trainers").
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache

SAME = """
sofa, couch, settee, loveseat, chesterfield, divan, davenport
armchair, easy chair, lounge chair, comfy chair, recliner, club chair, wing chair
office chair, desk chair, swivel chair, computer chair, rolling chair, task chair
dining chair, kitchen chair, side chair
high chair, baby chair, feeding chair
bar stool, counter stool
stool, footstool, ottoman, pouf, footrest
bench, settle
deck chair, lawn chair, garden chair, patio chair, outdoor chair
rocking chair, rocker
folding chair, camping chair
wheelchair, wheel chair
bean bag, beanbag
coffee table, cocktail table, center table, centre table, sofa table
dining table, kitchen table, dinner table
desk, writing desk, writing table, computer desk, work desk
workbench, work bench, work table, tool bench
side table, end table, occasional table
nightstand, bedside table, night table, bedside cabinet, night stand
dressing table, vanity table, vanity, makeup table, make-up table
console table, hall table
bed, double bed, single bed, king size bed
bunk bed, loft bed, two-tier bed, double-decker bed
crib, cot, baby bed, baby cot
mattress, bed mattress
wardrobe, closet, armoire, clothes cupboard, clothes cabinet
dresser, chest of drawers, bureau, drawers, tallboy, chest
sideboard, buffet, credenza
cabinet, cupboard
kitchen cabinet, kitchen cupboard, kitchen unit, base cabinet, wall cabinet
filing cabinet, file cabinet, document cabinet
display cabinet, showcase, vitrine, china cabinet, glass cabinet
shoe cabinet, shoe rack, shoe cupboard, shoe storage
bookcase, bookshelf, bookshelves, bookrack, shelf with books
shelf, shelves, shelving, rack
coat rack, coat stand, hat stand, coat tree, clothes rack, clothes stand
umbrella stand, umbrella holder, umbrella rack
tv stand, tv cabinet, media console, tv bench, television cabinet, television stand, tv unit
safe, strongbox, vault
trunk, storage chest, toy chest, toy box
rug, carpet, area rug, carpeting
doormat, door mat, welcome mat, entrance mat
bath mat, bathroom rug, bath rug, shower mat
yoga mat, exercise mat, gym mat, gymnastics mat, fitness mat
curtain, drape, drapes, curtains
blind, window blind, shade, roller blind, venetian blind
mirror, looking glass
picture, painting, framed picture, picture frame, photo frame, artwork, print
poster, placard
clock, wall clock, timepiece
alarm clock, clock radio
candle, taper
candlestick, candle holder, candelabra
vase, flower vase
flower pot, flowerpot, plant pot, planter, pot
potted plant, houseplant, plant, pot plant, indoor plant
flowers, bouquet, bunch of flowers
cushion, pillow, throw pillow, scatter cushion
blanket, throw, comforter, quilt, duvet
towel, bath towel, hand towel
floor lamp, standing lamp, standing light, torchiere, floor light
table lamp, bedside lamp, bedside light
desk lamp, desk light, reading lamp, work lamp
ceiling lamp, ceiling light, pendant lamp, hanging lamp
lamp, light
chandelier, candelabrum
flashlight, torch, pocket lamp
television, tv, telly, tv set, flat screen, flat screen tv
monitor, computer monitor, computer screen, pc screen, display
remote control, remote, clicker, tv remote
loudspeaker, speaker, hifi speaker, stereo speaker, speaker box
stereo, hi-fi, music system, sound system
radio, portable radio, wireless
record player, turntable, gramophone
dvd player, video player
game console, gaming console, video game console, playstation, xbox
projector, beamer, video projector
laptop, laptop computer, notebook computer, portable computer
computer, pc, desktop computer, computer tower
keyboard, computer keyboard
mouse, computer mouse
printer, inkjet printer, laser printer, copier, photocopier, copy machine, multifunction printer
scanner, document scanner
paper shredder, shredder, document shredder
telephone, phone, landline, desk phone
cell phone, mobile phone, smartphone, mobile, cellphone, handphone
tablet, tablet computer, ipad
calculator, pocket calculator
camera, photo camera
headphones, headset, earphones
charger, charging cable, power adapter
power strip, extension cord, multi plug, socket strip
whiteboard, white board, dry erase board, marker board, presentation board
blackboard, chalkboard
easel, painter's easel
notice board, bulletin board, pin board, cork board
book, novel, paperback, hardcover, volume
notebook, writing pad, notepad, exercise book
magazine, journal, periodical
newspaper, paper, daily
binder, folder, ring binder, file folder
pen, ballpoint, ballpoint pen, biro
scissors, pair of scissors
stapler, staple gun
globe, world globe, earth globe
map, world map
refrigerator, fridge, icebox, fridge freezer
freezer, deep freezer, chest freezer
stove, cooker, range, kitchen range, cooking stove, kitchen stove
oven, baking oven
cooktop, hob, hotplate, stovetop
microwave, microwave oven
toaster, bread toaster
kettle, electric kettle, tea kettle, teakettle, water boiler
coffee maker, coffee machine, espresso machine, coffee brewer, espresso maker
blender, mixer, smoothie maker, liquidizer
food processor, kitchen machine
dishwasher, dish washer, dishwashing machine
washing machine, washer, laundry machine, clothes washer
tumble dryer, dryer, clothes dryer, drying machine
extractor hood, range hood, cooker hood, exhaust hood
sink, basin, wash basin
kitchen sink, sink unit, washing-up sink
washbasin, bathroom sink, hand basin, lavabo
faucet, tap, water tap
cup, mug
coffee cup, coffee mug, teacup, tea cup
glass, drinking glass, tumbler, water glass
wine glass, goblet, wineglass
bottle, flask
water bottle, drinking bottle
thermos, thermos flask, vacuum flask, insulated bottle
plate, dish, dinner plate
bowl, dish
fruit bowl, bowl of fruit, fruit basket, fruit dish
tray, serving tray
pan, frying pan, skillet
pot, saucepan, cooking pot, stockpot
jug, pitcher, carafe
teapot, tea pot
knife, kitchen knife
cutlery, silverware, flatware
cutting board, chopping board
jar, canister
can, tin
wine rack, bottle rack, wine holder
water cooler, water dispenser, drinking fountain, water fountain
vending machine, snack machine, drinks machine
trash can, garbage can, bin, waste bin, rubbish bin, dustbin, wastebasket, waste basket, trash bin, litter bin
recycling bin, recycling container
bucket, pail
basket, wicker basket, woven basket
laundry basket, laundry hamper, clothes hamper, washing basket, hamper
bathtub, tub, bath, bath tub
shower, shower cabin, shower cubicle, shower stall, shower enclosure
toilet, lavatory, commode, loo, wc, toilet bowl
urinal, pissoir
bidet, bidet basin
toilet paper, toilet roll, loo roll, toilet tissue
paper towel, paper towels, kitchen roll
tissue box, box of tissues, kleenex
soap, bar of soap
soap dispenser, soap pump
toothbrush, tooth brush
hair dryer, hairdryer, blow dryer
bathroom scale, scale, scales, weighing scale
towel radiator, towel rail, heated towel rail, towel warmer, towel heater
radiator, heater, central heating, wall radiator
fireplace, hearth, fire place, open fire
fan, standing fan, electric fan, ventilator, pedestal fan
air conditioner, ac, air conditioning unit
air purifier, air cleaner, air filter
humidifier, air humidifier
thermostat, temperature control
fire extinguisher, extinguisher
smoke detector, smoke alarm, fire alarm
first aid kit, first aid box, medical kit, emergency kit, medicine box
defibrillator, aed
toolbox, tool box, tool chest, tool case, tool kit
ladder, stepladder, step ladder, steps, folding ladder
hammer, mallet
drill, power drill, electric drill
saw, handsaw
screwdriver, screw driver
wrench, spanner
vacuum cleaner, vacuum, hoover
robot vacuum, vacuum robot, robotic vacuum cleaner
broom, sweeping brush, floor brush
mop, floor mop
dustpan, dust pan
iron, clothes iron, flat iron, steam iron
ironing board, iron board, ironing table
drying rack, clothes drying rack, clothes horse, airer, laundry rack
sewing machine, stitching machine
cardboard box, carton, packing case, packing box, moving box
box, case
crate, bottle crate
suitcase, luggage, travel suitcase, travel case, baggage, trolley case
backpack, rucksack, knapsack, school bag, schoolbag, book bag
briefcase, attache case, document case
handbag, purse, ladies' bag
shopping bag, carrier bag, grocery bag
bag, sack
wallet, billfold
umbrella, brolly, parasol
shoes, pair of shoes, footwear
sneakers, trainers, running shoes, gym shoes
boots, pair of boots
slippers, house shoes
coat, overcoat
jacket, blazer
hat, cap
glasses, eyeglasses, spectacles
bicycle, bike, cycle, pushbike
motorcycle, motorbike
scooter, kick scooter
stroller, baby carriage, pram, pushchair, buggy, baby buggy
shopping cart, shopping trolley
hand truck, sack truck, trolley, dolly
car, automobile
tire, tyre, car tire, wheel
skateboard, longboard
skis, pair of skis
helmet, bike helmet
basketball, hoop ball
soccer ball, football
ball, sphere
exercise ball, gym ball, yoga ball, fitness ball, swiss ball
dumbbell, dumbbells, hand weight, weights
treadmill, running machine, jogging machine
exercise bike, stationary bike, spinning bike, fitness bike, home trainer
punching bag, punch bag
piano, upright piano, pianoforte
guitar, acoustic guitar
violin, fiddle
drums, drum kit, drum set
trumpet, horn
teddy bear, teddy, stuffed bear, plush bear, cuddly bear
stuffed animal, plush toy, soft toy, cuddly toy
doll, dolly
dollhouse, doll house, doll's house
rocking horse, toy horse, hobby horse
toy car, model car, miniature car
building blocks, toy bricks, lego
puzzle, jigsaw, jigsaw puzzle
board game, parlour game
pool table, billiard table
ping pong table, table tennis table
table football, foosball table
cat, kitty, kitten, feline
dog, puppy, hound, doggy
fish tank, aquarium, fishbowl
bird cage, birdcage
dog bed, pet bed, dog basket
litter box, cat toilet
watering can, sprinkling can
barbecue, barbecue grill, grill, bbq
lawn mower, mower, grass cutter
wheelbarrow, barrow
shovel, spade
rake, leaf rake
hose, garden hose
gas bottle, gas cylinder, propane tank
door, doorway
stairs, staircase, steps, stairway
elevator, lift
window, glass window
mailbox, letter box, letterbox, post box
sign, signboard
exit sign, emergency exit sign
flag, banner
person, human, man, woman
hospital bed, patient bed
iv stand, infusion stand, drip stand
forklift, fork lift, lift truck
pallet, euro pallet
barrel, drum, keg
toilet brush, loo brush
microphone, mic
tripod, camera stand
cash register, till
mannequin, dummy
"""

# A kind, and things of that kind: asked for the kind, each of them will do.
KINDS = """
pet: cat, dog, rabbit, hamster, parrot, goldfish
animal: cat, dog, bird, fish
seat: chair, armchair, sofa, stool, bench, office chair
chair: armchair, office chair, dining chair, folding chair, high chair, rocking chair
table: dining table, coffee table, desk, side table, nightstand
lamp: floor lamp, table lamp, desk lamp, ceiling lamp
light: floor lamp, table lamp, desk lamp, ceiling lamp
bed: bunk bed, double bed, crib
cabinet: kitchen cabinet, filing cabinet, wardrobe, sideboard, dresser, shoe cabinet, tv stand
shelf: bookcase, wine rack
bag: backpack, suitcase, handbag, briefcase
ball: basketball, soccer ball, exercise ball
toy: teddy bear, doll, toy car, rocking horse, building blocks, dollhouse
plant: potted plant, flowers, small tree
screen: television, computer monitor
computer: laptop, desktop computer
appliance: refrigerator, washing machine, dishwasher, stove, microwave, toaster
musical instrument: piano, guitar, violin, drums, trumpet
instrument: piano, guitar, violin, drums, trumpet
vehicle: bicycle, motorcycle, car, scooter, stroller
fruit: apple, banana, orange, fruit bowl
crockery: cup, plate, bowl, glass
container: box, bucket, basket, bottle, bin
rug: bath mat, doormat
mat: bath mat, doormat, yoga mat
tool: hammer, drill, screwdriver, wrench, saw
sink: kitchen sink, washbasin
basket: laundry basket, fruit basket
board: whiteboard, blackboard, ironing board
box: cardboard box, toolbox, toy box
machine: washing machine, coffee maker, sewing machine, vending machine
furniture: sofa, table, chair, bed, wardrobe, cabinet
"""

# What a thing is for, by what is done with it, as `purpose_of` gives it ("something to sit on" is to "sit"). A verb
# that stands alone in a row is enough by itself: "write a letter" is to "write".
FOR = """
sit, sit down, rest, have seat, take seat: chair, sofa, armchair, stool, bench
sleep, lie, lie down, nap, take nap: bed, sofa, mattress
drink: cup, mug, glass, bottle
read: book, magazine, newspaper
write, draw: pen, pencil
write on, draw on: whiteboard, notebook, desk
eat from, eat out of: plate, bowl
eat, eat at, dine: dining table
work, work at, study: desk
cook, fry: stove, pan, pot
bake: oven
heat food, warm food, warm up food, heat up food: microwave, stove, oven
keep food cold, keep drinks cold, keep milk cold, keep cold, cool, cool drinks: refrigerator, freezer
wash hands: sink, washbasin
wash dishes, do dishes: kitchen sink, dishwasher
wash clothes, do laundry, wash laundry: washing machine
dry clothes, dry laundry: tumble dryer, drying rack
dry hands: towel, paper towel
dry hair: hair dryer
iron, iron clothes, iron shirt: iron, ironing board
hang coat, hang jacket, hang up coat: coat rack, wardrobe
store clothes, put clothes, keep clothes: wardrobe, dresser
store books, put books, keep books: bookcase
throw away, put rubbish, put trash, put garbage, throw rubbish, throw trash, throw garbage: trash can
play: toy, ball, teddy bear, game console
play music, make music: piano, guitar
listen to music, hear music: loudspeaker, stereo, radio
watch, watch movies, watch tv: television
type: keyboard, laptop, computer
ride: bicycle, scooter
clean, sweep, mop: broom, vacuum cleaner, mop
put out fire, extinguish: fire extinguisher
climb, reach ceiling: ladder, step stool
pack, travel: suitcase, backpack
keep dry, use rain: umbrella
call, make call, phone: telephone, cell phone
print: printer
light, see dark: lamp, flashlight
make coffee, brew coffee: coffee maker
make toast, toast: toaster
boil water, make tea: kettle
cut: knife, scissors
see myself, look at myself: mirror
tell time, see time, know time: clock, alarm clock
take bath, bathe: bathtub
take shower, shower: shower
brush teeth: toothbrush
exercise, work out: treadmill, exercise bike, dumbbell
"""


PURPOSE = re.compile(r"(?:^|\s)(?:(?:that |which )?(?:i|we|you|one) (?:can|could)|to|(?P<gerund>for)) (?P<what>.+)$")
SMALL = frozenset(("my", "our", "your", "the", "a", "an", "some", "this", "that", "these", "something", "things", "it"))
PARTICLES = frozenset(("on", "in", "into", "from", "out", "of", "with", "at", "to", "by", "under", "onto"))


@cache
def same(words: str) -> tuple[str, ...]:
    """Other names of exactly this thing, in the order of the rows; () where none is known."""
    names = [name for row in _rows(SAME) if words in row for name in row]
    return tuple(dict.fromkeys(name for name in names if name != words))


@cache
def kinds(words: str) -> tuple[str, ...]:
    """What is of this kind, or serves the purpose that the words name; () where nothing is known."""
    of_kind = [thing for kind, things in _pairs(KINDS) if words in kind for thing in things]
    return tuple(dict.fromkeys([*of_kind, *_serving(purpose_of(words))]))


def purpose_of(words: str) -> tuple[str, ...]:
    """What a thing is for, as said and barer: "something to wash my hands in" -> "wash hands in", "wash hands"."""
    found = PURPOSE.search(words)
    if found is None:
        return ()
    said = [word for word in found["what"].split() if word not in SMALL]
    if found["gerund"] and said and said[0].endswith("ing"):
        said[0] = re.sub(r"(.)\1$", r"\1", said[0].removesuffix("ing"))
    barer = list(said)
    while len(barer) > 1 and barer[-1] in PARTICLES:
        barer.pop()
    return tuple(dict.fromkeys(" ".join(each) for each in (said, barer, said[:1]) if each))


def _serving(purposes: Sequence[str]) -> tuple[str, ...]:
    """The things of the first of these purposes that a row knows."""
    for purpose in purposes:
        if things := [thing for verbs, things in _pairs(FOR) if purpose in verbs for thing in things]:
            return tuple(things)
    return ()


def other_thing(words: str, phrase: str) -> bool:
    """Whether both are known, and no speaker would take the one for the other: a folding chair is no comfy chair.

    Words that are part of each other may be the same thing ("chair", "folding chair"), and so may those of which one
    is a kind of what the other is called: a coffee mug is a mug, which is a cup.
    """
    if words == phrase or any(_ends_in(a, b) for a, b in ((words, phrase), (phrase, words))):
        return False
    if not (is_known(words) and is_known(phrase)):
        return False
    return phrase not in same(words) and not _of_kind(words, phrase) and not _of_kind(phrase, words)


def _ends_in(longer: str, shorter: str) -> bool:
    return any(longer.endswith(f" {name}") for name in (shorter, *same(shorter)))


def _of_kind(kind: str, phrase: str) -> bool:
    things = kinds(kind)
    return phrase in things or any(phrase in same(thing) for thing in things)


def is_known(words: str) -> bool:
    """Whether some row holds exactly these words."""
    return words in _names()


@cache
def _names() -> frozenset[str]:
    of_kinds = (name for halves in _pairs(KINDS) for half in halves for name in half)
    return frozenset([*(name for row in _rows(SAME) for name in row), *of_kinds])


@cache
def is_word(word: str) -> bool:
    """Whether some row holds this word by itself or in a name: it is spelt right."""
    return word in _words()


@cache
def _words() -> frozenset[str]:
    return frozenset(re.findall(r"[a-z'-]+", f"{SAME} {KINDS} {FOR}"))


@cache
def _rows(table: str) -> tuple[tuple[str, ...], ...]:
    return tuple(tuple(name.strip() for name in row.split(",")) for row in table.strip().splitlines())


@cache
def _pairs(table: str) -> tuple[tuple[tuple[str, ...], tuple[str, ...]], ...]:
    halves = (row.partition(":") for row in table.strip().splitlines())
    return tuple((_rows(kind)[0], _rows(things)[0]) for kind, _, things in halves)
