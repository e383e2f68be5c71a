from envgen_usd.label_taxonomy import label, labels

# cityscapesScripts labels.py: id, trainId is ours, colour.
CITYSCAPES = {
    "road": (7, (128, 64, 128)),
    "sidewalk": (8, (244, 35, 232)),
    "building": (11, (70, 70, 70)),
    "pole": (17, (153, 153, 153)),
    "vegetation": (21, (107, 142, 35)),
    "terrain": (22, (152, 251, 152)),
    "sky": (23, (70, 130, 180)),
}


def test_the_seven_classes_have_the_ids_and_colours_of_cityscapes() -> None:
    for train_id, (name, (number, colour)) in enumerate(CITYSCAPES.items()):
        entry = label(name)
        assert (entry.id, entry.colour, entry.train_id) == (number, colour, train_id)


def test_ids_and_colours_are_unique_and_ids_fit_a_byte() -> None:
    table = labels()
    assert len({entry.id for entry in table}) == len(table)
    assert len({entry.colour for entry in table}) == len(table)
    assert all(0 <= entry.id < 256 for entry in table)
