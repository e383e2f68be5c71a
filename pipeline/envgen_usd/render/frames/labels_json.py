"""The file ``labels.json``: the meaning of the values in label images."""

import json
from dataclasses import asdict

from envgen_usd.label_taxonomy import labels, parts


def labels_json() -> str:
    """The taxonomy as JSON: classes with id, colour and tokens, and ids of the parts."""
    classes = [asdict(entry) for entry in labels()]
    return json.dumps({"classes": classes, "parts": {"no_part": 0} | parts()}, indent=1) + "\n"
