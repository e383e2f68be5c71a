"""Reads formats with the libraries of their makers; run by `test_formats` in its environment.

Prints a line of JSON with what the readers say. This file imports nothing of envgen-usd.
"""

import json
import math
import os
import sys
import types
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
    import yaml
    from kitti360scripts.devkits.commons.loadCalibration import loadCalibrationRigid
    from kitti360scripts.helpers.annotation import Annotation2D, Annotation2DInstance, Annotation3D
    from kitti360scripts.helpers.labels import labels
    from kitti360scripts.helpers.project import CameraFisheye, CameraPerspective
    from PIL import Image

    load = yaml.load  # kitti360Scripts is of the time of PyYAML 5, which had a default here
    yaml.load = lambda text, Loader=yaml.SafeLoader: load(text, Loader)
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
    wide = [n for n in (2, 3) if (raw / f"image_{n:02d}").is_dir()]
    lenses = [CameraFisheye(str(root), sequence.name, number) for number in wide]
    velodyne = loadCalibrationRigid(str(root / "calibration" / "calib_cam_to_velo.txt"))
    # The viewer's module wants Open3D, which draws; its reader of scans does not.
    sys.modules["open3d"] = types.ModuleType("open3d")
    from kitti360scripts.viewer.kitti360Viewer3DRaw import Kitti360Viewer3DRaw

    points = Kitti360Viewer3DRaw(seq=0, mode="velodyne").loadVelodyneData(2)
    seen_by_camera = (
        np.column_stack((points[:, :3], np.ones(len(points)))) @ np.linalg.inv(velodyne).T
    )
    world = seen_by_camera @ cameras[0].cam2world[2].T if 2 in cameras[0].cam2world else []
    boxes = {}
    if (root / "data_3d_bboxes").is_dir():
        for each in Annotation3D(str(root / "data_3d_bboxes"), sequence.name).objects.values():
            assert list(each) == [-1]  # It does not move.
            box = each[-1]
            boxes[f"{box.semanticId} {box.instanceId}"] = {
                "vertices": box.vertices.tolist(),
                "sides": [[int(a), int(b)] for a, b in box.lines],
                "faces": box.faces.astype(int).tolist(),
                "frames": [box.start_frame, box.end_frame],
                "name": box.name,
            }
    return {
        "fisheyes": {
            f"{c.cam_id} {int(f)}": c.cam2world[f].tolist() for c in lenses for f in c.frames
        },
        "bent": [[float(x[0]) for x in c.cam2image(point.T)[:2]] for c in lenses],
        "world": world.tolist(),
        "boxes": boxes,
        "intensities": points[:, 3].tolist(),
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


def py123d(root):
    """Sensors, poses, boxes that points are in, and the map of each sequence."""
    import tempfile

    from py123d.datatypes import BoxDetectionsSE3, EgoStateSE3
    from py123d.parser.base_dataset_parser import ParsedCamera, ParsedLidar
    from py123d.parser.kitti360.kitti360_parser import Kitti360Parser
    from py123d.parser.kitti360.kitti360_sensor_io import load_kitti360_point_cloud_data_from_path

    names = sorted(path.name for path in (root / "data_2d_raw").iterdir())
    with tempfile.TemporaryDirectory() as cache:
        data = Kitti360Parser(["kitti360_train"], root, cache, 80.0, names, [], [])
        found = {}
        for log in data.get_log_parsers():
            rows = []
            for each in log.iter_modalities_sync():
                row = {"time": each.timestamp.time_us, "cameras": {}, "boxes": {}}
                for part in each.modalities:
                    if isinstance(part, EgoStateSE3):
                        row["imu"] = part.imu_se3.transformation_matrix.tolist()
                    elif isinstance(part, BoxDetectionsSE3):
                        for box in part.box_detections:
                            row["boxes"][box.attributes.track_token] = {
                                "label": box.attributes.label.name,
                                "corners": box.bounding_box_se3.corners_array.tolist(),
                            }
                    elif isinstance(part, ParsedCamera):
                        place = part.camera_to_global_se3.transformation_matrix.tolist()
                        row["cameras"][str(part.relative_path)] = place
                    elif isinstance(part, ParsedLidar):
                        points, features = load_kitti360_point_cloud_data_from_path(
                            root / part._relative_path, part.metadata.lidar_metadatas
                        )
                        row["points"] = points.tolist()
                        row["intensities"] = features["intensity"].tolist()
                rows.append(row)
            found[log.get_log_metadata().log_name] = rows
        maps = {
            each.get_map_metadata().log_name: len(list(each.iter_map_objects()))
            for each in data.get_map_parsers()
        }
    return {"logs": found, "maps": maps}


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


def _seen_points(data):
    """Pixels and depths of a scan's points in an image, as the devkit projects them."""
    mark = data.sample[0]["data"]
    camera = next(name for name in mark if name.startswith("CAM_"))
    points, depths, _ = data.explorer.map_pointcloud_to_image(mark["LIDAR_TOP"], mark[camera])
    path = data.get_sample_data_path(mark[camera])
    return {"path": path, "pixels": points[:2].T.tolist(), "depths": depths.tolist()}


def nuscenes(root):
    """Scenes, images with boxes in camera space, poses, tracks, maps and splits."""
    import numpy as np
    from nuscenes import NuScenes
    from nuscenes.utils.data_classes import LidarPointCloud
    from nuscenes.utils.data_io import load_bin_file
    from nuscenes.utils.geometry_utils import BoxVisibility, points_in_box, transform_matrix
    from nuscenes.utils.splits import get_scenes_of_split
    from pyquaternion import Quaternion

    data = NuScenes("v1.0-trainval", str(root), verbose=False)
    images, scans, inside = [], [], {}
    for row in data.sample_data:
        if row["sensor_modality"] == "lidar":
            place = data.get("calibrated_sensor", row["calibrated_sensor_token"])
            pose = data.get("ego_pose", row["ego_pose_token"])
            cloud = LidarPointCloud.from_file(data.get_sample_data_path(row["token"]))
            for each in (place, pose):
                cloud.transform(transform_matrix(each["translation"], Quaternion(each["rotation"])))
            classes = load_bin_file(
                str(root / data.get("lidarseg", row["token"])["filename"]), "lidarseg"
            )
            path, boxes, _ = data.get_sample_data(row["token"], BoxVisibility.NONE)
            local = LidarPointCloud.from_file(path).points[:3].astype(np.float64)
            inside.update({box.token: int(points_in_box(box, local).sum()) for box in boxes})
            scans.append(
                {
                    "path": path,
                    "channel": row["channel"],
                    "sample": row["sample_token"],
                    "points": cloud.points.T.tolist(),
                    "classes": [data.lidarseg_idx2name_mapping[index] for index in classes],
                }
            )
            continue
        path, boxes, intrinsics = data.get_sample_data(row["token"], BoxVisibility.NONE)
        place = data.get("calibrated_sensor", row["calibrated_sensor_token"])
        pose = data.get("ego_pose", row["ego_pose_token"])
        ego, camera = (
            transform_matrix(each["translation"], Quaternion(each["rotation"]))
            for each in (pose, place)
        )
        sample = data.get("sample", row["sample_token"])
        scene = data.get("scene", sample["scene_token"])
        town = data.get("log", scene["log_token"])["location"]
        mask = data.get("map", data.get("log", scene["log_token"])["map_token"])
        origin = mask["stage_origin"]
        x, y = ego[:2, 3]
        images.append(
            {
                "path": path,
                "exists": Path(path).is_file(),
                "scene": scene["name"],
                "town": town,
                "channel": row["channel"],
                "timestamp": row["timestamp"],
                "next": row["next"] and data.get("sample_data", row["next"])["timestamp"],
                "intrinsics": intrinsics.tolist(),
                "camera_to_world": (ego @ camera).tolist(),
                "origin": origin,
                "on_road": bool(mask["mask"].is_on_mask(x, y)[0]),
                "beside": mask["mask"].is_on_mask([x, x, x], [y + 4.8, y + 5.2, y - 3.2]).tolist(),
                "boxes": {box.token: box.corners().T.tolist() for box in boxes},
            }
        )
    annotations = [
        {
            "token": row["token"],
            "category": row["category_name"],
            "attribute": data.get("attribute", row["attribute_tokens"][0])["name"],
            "visibility": data.get("visibility", row["visibility_token"])["level"],
            "instance": row["instance_token"],
            "sample": row["sample_token"],
            "lidar": [row["num_lidar_pts"], inside.get(row["token"])],
            "volume": math.prod(row["size"]),
        }
        for row in data.sample_annotation
    ]
    tracks = {}
    for row in data.instance:
        track, mark = [], row["first_annotation_token"]
        while mark:
            track.append(mark)
            mark = data.get("sample_annotation", mark)["next"]
        assert track[-1] == row["last_annotation_token"]
        assert len(track) == row["nbr_annotations"]
        tracks[row["token"]] = track
    walked = {}
    for row in data.scene:
        mark, walked[row["name"]] = row["first_sample_token"], 0
        while mark:
            walked[row["name"]] += 1
            mark = data.get("sample", mark)["next"]
        assert walked[row["name"]] == row["nbr_samples"]
    splits = {name: get_scenes_of_split(f"envgen_{name}", data) for name in ("train", "val")}
    names = {row["name"]: row["index"] for row in data.category}
    assert list(names) == list(data.colormap)
    return {
        "images": images,
        "scans": scans,
        "annotations": annotations,
        "seen": _seen_points(data) if scans else None,
        "tracks": tracks,
        "scenes": walked,
        "splits": splits,
    }


def webdataset(root):
    """Samples as webdataset's reader and its decoders give them."""
    import hashlib

    import webdataset as wds

    found = {}
    for split in ("train", "val"):
        shards = sorted(str(path) for path in root.glob(f"{split}-*.tar"))
        raw = {row["__key__"]: row for row in wds.WebDataset(shards, shardshuffle=False)}
        decoded = wds.WebDataset(shards, shardshuffle=False).decode("rgb8")
        found[split] = [
            {
                "key": row["__key__"],
                "kinds": sorted(kind for kind in row if not kind.startswith("__")),
                "json": row["json"],
                "shape": list(row["rgb.png"].shape),
                "boxes": len(row["boxes.json"]) if "boxes.json" in row else 0,
                "scan": {
                    kind: [str(values.dtype), values.tolist()]
                    for kind, values in row.items()
                    if kind.endswith(".npy")
                },
                "sha256": {
                    kind: hashlib.sha256(content).hexdigest()
                    for kind, content in raw[row["__key__"]].items()
                    if not kind.startswith("__")
                },
            }
            for row in decoded
        ]
    return found


def ultralytics(root):
    """Pictures and boxes as Ultralytics' loader gives them to the training."""
    import tempfile

    import torch

    # What torchvision's wheel brings for another version of torch; no box is suppressed here.
    for name in ("nms", "qnms"):
        torch.library.define(
            f"torchvision::{name}", "(Tensor dets, Tensor scores, float t) -> Tensor"
        )
    os.environ["YOLO_OFFLINE"] = "true"
    with tempfile.TemporaryDirectory() as settings:
        os.environ["YOLO_CONFIG_DIR"] = settings
        from ultralytics.data import YOLODataset
        from ultralytics.data.utils import check_det_dataset

        data = check_det_dataset(str(root / "data.yaml"), autodownload=False)
        found = {}
        for split in ("train", "val"):
            images = YOLODataset(
                img_path=data[split], data=data, task="detect", augment=False, imgsz=64
            )
            found[split] = [
                {
                    "stem": Path(row["im_file"]).stem,
                    "shape": list(row["shape"]),
                    "classes": [data["names"][int(kind)] for kind in row["cls"].reshape(-1)],
                    "boxes": row["bboxes"].tolist(),
                    "pixels": list(images[number]["img"].shape),
                }
                for number, row in enumerate(images.get_labels())
            ]
    return {"names": list(data["names"].values()), "splits": found}


READERS = {
    "ultralytics": ultralytics,
    "cityscapes": cityscapes,
    "kitti360": kitti360,
    "py123d": py123d,
    "coco": coco,
    "yolo": yolo,
    "nuscenes": nuscenes,
    "webdataset": webdataset,
}

if __name__ == "__main__":
    answer = READERS[sys.argv[1]](Path(sys.argv[2]))
    print(json.dumps(answer))
