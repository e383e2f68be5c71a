"""Runs ultralytics: ``python -m envgen_usd.study.yolo_process job.json``. See `yolo_learner`."""

import json
import os
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from envgen_usd.models.array_types import ByteArray
from envgen_usd.study.known_networks import define_operators
from envgen_usd.study.study_classes import VOID

_WEIGHTS = "run/weights/last.pt"


def main(path: Path) -> None:
    """Carries a job out.

    Args:
        path: Its file, in the folder with ``images``, ``labels`` and ``data.yaml``.
    """
    os.environ["YOLO_OFFLINE"] = "true"
    job, root = json.loads(path.read_text(encoding="utf-8")), path.parent
    define_operators()
    yolo = import_module("ultralytics").YOLO
    _use_own_suppression()
    if job["do"] == "train":
        # ultralytics' own changes of colour and frame are its augmentation; off, only flips stay.
        off = dict.fromkeys(("hsv_h", "hsv_s", "hsv_v", "scale", "translate", "mosaic"), 0.0)
        yolo(job["model"]).train(
            data=str(root / "data.yaml"),
            epochs=job["epochs"],
            batch=job["batch"],
            imgsz=job["size"],
            seed=job["seed"],
            project=str(root),
            name="run",
            val=False,
            plots=False,
            amp=import_module("torch").cuda.is_available(),
            pretrained=False,
            workers=0,
            verbose=False,
            **({} if job["augmented"] else off),
        )
        return
    network = yolo(str(root / _WEIGHTS))
    pictures = np.load(root / "asked.npy")
    said = [_classes(network, picture, job["size"]) for picture in pictures]
    np.save(root / "answer.npy", np.stack(said))


def _use_own_suppression() -> None:
    """Lets ultralytics suppress overlaps itself where torchvision's compiled part is missing.

    It calls torchvision's function wherever torchvision is imported, whether it works or not.
    """
    has_kernel = import_module("torch")._C._dispatch_has_kernel_for_dispatch_key
    if not has_kernel("torchvision::nms", "CPU"):
        own = import_module("ultralytics.utils.nms").TorchNMS
        import_module("torchvision").ops.nms = own.nms


def _classes(network: Any, picture: ByteArray, size: int) -> ByteArray:  # noqa: ANN401 - no types
    """Classes of a picture, H x W; surer instances lie above, and `VOID` is where none is."""
    turned = np.ascontiguousarray(picture[..., ::-1])  # ultralytics takes BGR
    result = network.predict(
        turned, imgsz=size, conf=0.05, verbose=False, retina_masks=True, max_det=100
    )[0]
    classes = np.full(picture.shape[:2], VOID, np.uint8)
    if result.masks is not None:
        sure = result.boxes.conf.cpu().numpy()
        kinds, masks = result.boxes.cls.cpu().numpy(), result.masks.data.cpu().numpy()
        for number in np.argsort(sure):
            classes[masks[number] > 0.5] = int(kinds[number])
    return classes


if __name__ == "__main__":
    main(Path(sys.argv[1]))
