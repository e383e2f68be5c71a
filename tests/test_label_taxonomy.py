import json

from envgen_usd.label_taxonomy import label, labels, parts
from envgen_usd.models.landuse import LanduseClass
from envgen_usd.render.frames.labels_json import labels_json

# cityscapesScripts 2.3.0, kitti360Scripts 1.0.0, helpers/labels.py: name, id, trainId, color, and
# hasInstances of Cityscapes and of KITTI-360.
PUBLISHED = """
unlabeled        0 255   0   0   0 - -
road             7   0 128  64 128 - -
sidewalk         8   1 244  35 232 - -
parking          9 255 250 170 160 - -
building        11   2  70  70  70 - +
wall            12   3 102 102 156 - -
fence           13   4 190 153 153 - -
guard_rail      14 255 180 165 180 - -
bridge          15 255 150 100 100 - -
tunnel          16 255 150 120  90 - -
pole            17   5 153 153 153 - +
traffic_light   19   6 250 170  30 - +
traffic_sign    20   7 220 220   0 - +
person 24 11 220 20 60 + +
rider 25 12 255 0 0 + +
car 26 13 0 0 142 + +
truck 27 14 0 0 70 + +
bus 28 15 0 60 100 + +
train 31 16 0 80 100 + +
motorcycle 32 17 0 0 230 + +
bicycle 33 18 119 11 32 + +
vegetation      21   8 107 142  35 - -
terrain         22   9 152 251 152 - -
sky             23  10  70 130 180 - -
static           4 255   -   -   - - -
"""
ARTICLE = ("road", "sidewalk", "building", "pole", "vegetation", "terrain", "sky")


def test_each_class_has_the_ids_and_train_ids_of_both_data_sets() -> None:
    rows = {
        row[0].replace("_", " "): row[1:] for row in map(str.split, PUBLISHED.split("\n")) if row
    }
    assert {entry.cityscapes for entry in labels()} == rows.keys()
    for entry in labels():
        number, train_id, *colour, in_cityscapes, in_kitti = rows[entry.cityscapes]
        assert entry.id == entry.cityscapes_id == entry.kitti_360_id == int(number)
        assert entry.cityscapes_train_id == entry.kitti_360_train_id == int(train_id)
        assert entry.cityscapes_has_instances == (in_cityscapes == "+")
        assert entry.kitti_360_has_instances == (in_kitti == "+")
        if "-" not in colour:
            assert entry.colour == tuple(map(int, colour))


def test_the_seven_classes_of_the_article_are_numbered_for_training() -> None:
    assert [label(name).article_train_id for name in ARTICLE] == list(range(7))
    assert all(label(name).article_id == label(name).id for name in ARTICLE)
    finer = [entry for entry in labels() if entry.name not in ARTICLE]
    assert {(entry.article_id, entry.article_train_id) for entry in finer} == {(255, 255)}


def test_labels_json_has_each_train_id_under_its_name() -> None:
    rows = {row["name"]: row for row in json.loads(labels_json())["classes"]}
    fence = rows["fence"]
    assert (fence["cityscapes_id"], fence["cityscapes_train_id"]) == (13, 4)
    assert (fence["kitti_360_id"], fence["kitti_360_train_id"]) == (13, 4)
    assert (fence["article_id"], fence["article_train_id"]) == (255, 255)
    assert all("train_id" not in row for row in rows.values())


def test_ids_and_colours_are_unique_and_ids_fit_a_byte() -> None:
    table = labels()
    assert len({entry.id for entry in table}) == len(table)
    assert len({entry.colour for entry in table}) == len(table)
    assert all(0 <= entry.id < 256 for entry in table)


def test_every_ground_is_a_part_of_its_own() -> None:
    grounds = [kind for kind in LanduseClass if kind > LanduseClass.ROAD]
    values = [parts()[kind.name.lower()] for kind in grounds]
    assert len(set(values)) == len(values)
    assert all(0 < value < 256 for value in parts().values())


def test_labels_json_names_the_parts_and_the_lack_of_one() -> None:
    named = json.loads(labels_json())["parts"]
    assert [name for name, number in named.items() if number == 0] == ["no_part"]
