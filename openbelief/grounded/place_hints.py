"""What usually stands where: the things by which a person tells a kitchen from a bathroom."""

from __future__ import annotations

# In the order of request.places; the words are common knowledge, written by hand.
HINTS: dict[str, tuple[str, ...]] = {
    place: tuple(things.split(", "))
    for place, things in {
        "kitchen": "refrigerator, stove, oven, kitchen sink, dishwasher, microwave, kettle, kitchen cabinet, toaster, "
        "coffee maker, dining table, frying pan",
        "bathroom": "toilet, bathtub, shower, washbasin, toilet paper, bath mat, towel, mirror, toothbrush, "
        "bathroom scale, towel radiator",
        "bedroom": "bed, nightstand, wardrobe, dresser, pillow, bedside lamp, alarm clock, dressing table",
        "living room": "sofa, television, coffee table, armchair, tv stand, fireplace, floor lamp, piano, rug, "
        "bookcase",
        "office": "desk, office chair, printer, computer monitor, filing cabinet, whiteboard, paper shredder, "
        "telephone, water cooler",
        "hallway": "coat rack, shoe cabinet, umbrella stand, doormat, shoes, stroller, bicycle, radiator",
        "dining room": "dining table, dining chair, sideboard, china cabinet, wine rack, candlestick",
        "kids room": "bunk bed, crib, teddy bear, toy, rocking horse, dollhouse, ball, toy car, toy box",
        "laundry room": "washing machine, tumble dryer, laundry basket, ironing board, drying rack, detergent",
        "study": "desk, bookcase, laptop, globe, office chair, desk lamp",
        "garage": "car, workbench, toolbox, lawn mower, car tire, ladder, bicycle, skis",
        "balcony": "garden chair, barbecue grill, flower pot, watering can, clothes drying rack",
        "storage room": "cardboard box, shelf, broom, ladder, bucket, vacuum cleaner",
        "entrance": "coat rack, shoe cabinet, umbrella stand, doormat, shoes",
    }.items()
}
