"""Street furniture that carries print: advertising panels, ticket machines, mailboxes."""

import numpy as np

from envgen_usd.assets.asset_design import AssetDesign, Model, Part, parted_model
from envgen_usd.assets.polygon_mesh import merge
from envgen_usd.assets.shapes.printed_faces import PrintedFaces
from envgen_usd.assets.shapes.simple_solids import box, lathe, post, turned
from envgen_usd.assets.signs.sign_sheets import SignSheet
from envgen_usd.errors import EnvgenError

_POSTER = "poster_"
"""Start of the names of faces that advertising panels show."""


def printed_designs(sheet: SignSheet) -> tuple[AssetDesign, ...]:
    """Returns the furniture that carries the faces of a sheet.

    Raises:
        EnvgenError: The sheet lacks a face that a piece needs.
    """
    prints = PrintedFaces(sheet)
    posters = {
        name.removeprefix(_POSTER): parted_model(_hoarding(prints, name))
        for name in prints.names
        if name.startswith(_POSTER)
    }
    if not posters:
        raise EnvgenError(f"sheet {sheet.name}: no face begins with '{_POSTER}'; add one")
    boxes = {"pillar": _mailbox_pillar(prints), "case": _mailbox_case(prints)}
    box_looks = {name: {"Body": f"paint_{name}"} for name in ("red", "yellow", "blue")}
    meter_looks = {name: {"Body": f"paint_{name}"} for name in ("blue", "grey")}
    meters = {"": _parking_meter(prints)}
    return (
        AssetDesign("hoarding", "hoarding", "static", posters, "print"),
        AssetDesign("mailbox", "mailbox", "static", boxes, "design", {"colour": box_looks}),
        AssetDesign(
            "parking_meter", "parking_meter", "static", meters, "", {"colour": meter_looks}
        ),
    )


def _hoarding(prints: PrintedFaces, poster: str) -> Model:
    """A lit advertising panel of 1.3 m x 2.5 m; it faces +x and -x."""
    case = merge(
        [
            box((-0.10, -0.65, 0.55), (0.10, 0.65, 0.65)),
            box((-0.10, -0.65, 2.40), (0.10, 0.65, 2.50)),
            box((-0.10, -0.65, 0.65), (0.10, -0.57, 2.40)),
            box((-0.10, 0.57, 0.65), (0.10, 0.65, 2.40)),
            box((-0.08, -0.20, 0.0), (0.08, 0.20, 0.55)),
        ]
    )
    board = box((-0.083, -0.57, 0.65), (0.083, 0.57, 2.40))
    front = prints.face(poster, 0.086, 0.65)
    return Model(
        (
            Part("Frame", case, "metal_dark", "frame"),
            Part("Board", board, "paint_white", "body"),
            prints.part("Print", front, turned(front, np.diag([-1.0, -1.0, 1.0]))),
        )
    )


def _parking_meter(prints: PrintedFaces) -> Model:
    """A ticket machine of 1.6 m; its display faces +x."""
    case = box((-0.14, -0.18, 0.12), (0.14, 0.18, 1.55))
    top = box((-0.16, -0.20, 1.55), (0.16, 0.20, 1.62))
    tray = box((0.14, -0.07, 0.88), (0.158, 0.07, 0.93))
    foot = box((-0.12, -0.15, 0.0), (0.12, 0.15, 0.12))
    panel, sign = prints.face("meter_panel", 0.144, 1.02), prints.face("meter_sign", 0.144, 0.56)
    return Model(
        (
            Part("Body", merge([case, top]), "paint_blue", "body"),
            prints.part("Plate", panel, sign),
            Part("Foot", merge([foot, tray]), "metal_dark", "foot"),
        )
    )


def _mailbox_pillar(prints: PrintedFaces) -> Model:
    """A pillar box of 1.6 m with a slot towards +x."""
    body = lathe(
        np.array(
            [[0.25, 0.0], [0.25, 0.08], [0.22, 0.10], [0.22, 1.36], [0.26, 1.40], [0.26, 1.45],
             [0.18, 1.54], [0.0, 1.60]]
        ), 18,
    )  # fmt: skip
    slot = box((0.20, -0.11, 1.22), (0.225, 0.11, 1.26))
    frame = box((0.19, -0.11, 0.84), (0.226, 0.11, 1.13))
    foot = lathe(np.array([[0.252, 0.0], [0.252, 0.08]]), 18)
    return Model(
        (
            Part("Body", body, "paint_red", "body"),
            Part("Slot", merge([slot, foot, frame]), "paint_black", "body"),
            prints.part("Plate", prints.face("mail_tall", 0.229, 0.85)),
        )
    )


def _mailbox_case(prints: PrintedFaces) -> Model:
    """A box on a post, with a slot towards +x."""
    case = box((-0.16, -0.24, 0.85), (0.16, 0.24, 1.45))
    lid = box((-0.18, -0.26, 1.45), (0.18, 0.26, 1.50))
    slot = box((0.16, -0.17, 1.30), (0.168, 0.17, 1.34))
    return Model(
        (
            Part("Body", merge([case, lid]), "paint_yellow", "body"),
            Part("Slot", merge([slot, post(0.85, 0.045, 10)]), "metal_dark", "body"),
            prints.part("Plate", prints.face("mail_wide", 0.164, 1.0)),
        )
    )
