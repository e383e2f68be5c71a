"""Reads formats with the libraries of their makers; run by `test_formats` in its environment.

Prints a line of JSON with what the readers say. This file imports nothing of envgen-usd.
"""

import json
import os
import sys
from pathlib import Path


def cityscapes(root):
    """The evaluation of ground truth against itself, and the parts of the names."""
    import cityscapesscripts.evaluation.evalPixelLevelSemanticLabeling as evaluation
    from cityscapesscripts.evaluation.instances2dict import instances2dict
    from cityscapesscripts.helpers.csHelpers import getCoreImageFileName, getCsFileInfo
    from cityscapesscripts.helpers.labels import labels

    truth = sorted(map(str, root.glob("gtFine/*/*/*_gtFine_labelIds.png")))
    pictures = sorted(root.glob("leftImg8bit/*/*/*_leftImg8bit.png"))
    evaluation.args.quiet, evaluation.args.JSONOutput = True, False
    result = evaluation.evaluateImgLists(truth, truth, evaluation.args)
    instances = instances2dict([truth[0].replace("labelIds", "instanceIds")])
    return {
        "names": [getCoreImageFileName(path) for path in truth],
        "pictures": [getCoreImageFileName(str(path)) for path in pictures],
        "cities": sorted({getCsFileInfo(path).city for path in truth}),
        "score": result["averageScoreClasses"],
        "classes": {name: score for name, score in result["classScores"].items() if score > 0},
        "instances": {
            name: sum(row["pixelCount"] for row in rows)
            for name, rows in next(iter(instances.values())).items()
            if rows
        },
        "labels": {row.name: [row.id, row.trainId, list(row.color)] for row in labels},
    }


def kitti360(root):
    """Evaluation of ground truth against itself, poses, calibration, instances."""
    os.environ["KITTI360_DATASET"] = str(root)
    import kitti360scripts.evaluation.semantic_2d.evalPixelLevelSemanticLabeling as evaluation
    import numpy as np
    from kitti360scripts.helpers.annotation import Annotation2D, Annotation2DInstance
    from kitti360scripts.helpers.labels import labels
    from kitti360scripts.helpers.project import CameraPerspective
    from PIL import Image

    semantics = root / "data_2d_semantics" / "train"
    truth = evaluation.getGroundTruth(str(semantics / "2013_05_28_drive_train_frames.txt"), 1)
    evaluation.args.quiet, evaluation.args.JSONOutput = True, False
    result = evaluation.evaluateImgLists([pair[0] for pair in truth], truth, evaluation.args)
    sequence = sorted(semantics.glob("*_sync"))[0]
    raw = root / "data_2d_raw" / sequence.name
    numbers = [number for number in (0, 1) if (raw / f"image_{number:02d}").is_dir()]
    cameras = [CameraPerspective(str(root), sequence.name, number) for number in numbers]
    annotation = Annotation2D()
    path = sequence / "image_00" / "instance" / "0000000000.png"
    annotation.loadInstance(str(path), toImg=False)
    found = Annotation2DInstance(str(sequence))
    seen = {
        int(value): sorted(found(*divmod(int(value), 1000)))
        for value in np.unique(np.asarray(Image.open(path)))
        if value % 1000
    }
    point = np.array([[1.0, 2.0, 30.0]])
    return {
        "score": result["averageScoreClasses"],
        "files": len(truth),
        "poses": {
            f"{c.cam_id} {int(f)}": c.cam2world[f].tolist() for c in cameras for f in c.frames
        },
        "projected": [
            [float(x[0]) for x in camera.cam2image(point.T[None])[:2]] for camera in cameras
        ],
        "semantic": sorted(set(annotation.semanticId.reshape(-1).tolist())),
        "seen": seen,
        "labels": {
            row.name: [row.id, row.trainId, list(row.color), row.hasInstances] for row in labels
        },
    }


def coco(root):
    """Masks, boxes and areas as pycocotools computes them."""
    from pycocotools import mask
    from pycocotools.coco import COCO

    data = COCO(str(root / "annotations" / "instances_train.json"))
    rows = []
    for annotation in data.loadAnns(data.getAnnIds()):
        rle = data.annToRLE(annotation)
        image = data.loadImgs(annotation["image_id"])[0]
        assert (root / "train" / image["file_name"]).is_file()
        rows.append(
            {
                "file": image["file_name"],
                "instance": annotation["instance"],
                "category": data.loadCats(annotation["category_id"])[0]["name"],
                "area": [int(mask.area(rle)), annotation["area"]],
                "bbox": [mask.toBbox(rle).tolist(), annotation["bbox"]],
                "corner": int(data.annToMask(annotation)[annotation["bbox"][1] :, :].sum()),
            }
        )
    return {"annotations": rows}


def yolo(root):
    """Boxes as supervision's reader of YOLO gives them."""
    import supervision

    data = supervision.DetectionDataset.from_yolo(
        str(root / "images" / "train"), str(root / "labels" / "train"), str(root / "data.yaml")
    )
    return {
        "classes": data.classes,
        "boxes": {
            Path(path).stem: [
                [data.classes[kind], *box]
                for kind, box in zip(found.class_id.tolist(), found.xyxy.tolist(), strict=True)
            ]
            for path, _, found in data
        },
    }


if __name__ == "__main__":
    reader = {"cityscapes": cityscapes, "kitti360": kitti360, "coco": coco, "yolo": yolo}
    answer = reader[sys.argv[1]](Path(sys.argv[2]))
    print(json.dumps(answer))
