"""What a recipe asks for in detail: towns to build, and takes to draw in them."""

import hashlib
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path, PurePosixPath

from envgen_usd.compressed_files import content_stem
from envgen_usd.errors import EnvgenError
from envgen_usd.recipe.dataset_recipe import STAGE_LIGHT, DatasetRecipe


@dataclass(frozen=True)
class Town:
    """A road in an environment with a seed.

    Attributes:
        road: OpenDRIVE file.
        country: Country of the environment.
        area: Area type.
        seed: Seed of the build.
    """

    road: Path
    country: str
    area: str
    seed: int

    @property
    def name(self) -> str:
        """Name of its folders, e.g. ``town_1_residential_0``."""
        return f"{content_stem(self.road)}_{self.country}_{self.area}_{self.seed}"


@dataclass(frozen=True)
class Take:
    """The frames of a town in a weather with a rig.

    Attributes:
        town: The town.
        weather: Weather as of `LightChoice`; empty for the light of the stage.
        rig: Name or file of the rig.
        frames: Number of frames.
        seed: Seed of places, light and camera.
    """

    town: Town
    weather: str
    rig: str
    frames: int
    seed: int

    @property
    def folder(self) -> str:
        """Folder of its frames in the data set."""
        weather = Path(self.weather).stem or STAGE_LIGHT
        return f"frames/{self.town.name}/{weather}_{Path(self.rig).stem}"


@dataclass(frozen=True)
class Block:
    """Consecutive frames of a take.

    Attributes:
        take: The take.
        numbers: Numbers of the frames.
    """

    take: Take
    numbers: tuple[int, ...]


def takes_of(recipe: DatasetRecipe) -> tuple[Take, ...]:
    """All takes, town by town.

    The seed of a take follows from its names, so that takes share no places, and a recipe with more
    takes has the same frames in those that it shares with another.
    """
    towns = [
        Town(Path(road.file), place.country, place.area, seed)
        for road, place, seed in product(recipe.road, recipe.environment, recipe.seeds)
    ]
    takes = []
    for town, weather, rig in product(towns, recipe.weathers, recipe.rigs):
        text = f"{recipe.seed} {town.name} {Path(weather).stem} {Path(rig).stem}"
        seed = int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "little") >> 1
        chosen = "" if weather == STAGE_LIGHT else weather
        takes.append(Take(town, chosen, rig, recipe.frames, seed))
    return tuple(takes)


def shard_of(takes: tuple[Take, ...], shard: tuple[int, int]) -> tuple[Block, ...]:
    """The frames of a shard: part `i` of `n` parts of all frames in their order.

    Shards are disjoint, differ by at most a frame, and each needs few towns.

    Args:
        takes: All takes.
        shard: i and n; i is 1 to n.
    """
    number, count = shard
    total = sum(take.frames for take in takes)
    first, last = total * (number - 1) // count, total * number // count
    blocks, begin = [], 0
    for take in takes:
        low, high = max(first - begin, 0), min(last - begin, take.frames)
        if low < high:
            blocks.append(Block(take, tuple(range(low, high))))
        begin += take.frames
    return tuple(blocks)


def files_of(blocks: Sequence[Block]) -> Callable[[str], bool]:
    """Tells by its path in the data set whether a file belongs to frames, or to all of a take."""
    numbers = defaultdict[str, set[int]](set)
    for block in blocks:
        numbers[block.take.folder].update(block.numbers)

    def is_own(name: str) -> bool:
        parts = PurePosixPath(name).parts
        own, stem = numbers.get("/".join(parts[:3])), parts[-1].partition(".")[0]
        return own is not None and (not stem.isdigit() or int(stem) in own)

    return is_own


def parse_shard(text: str) -> tuple[int, int]:
    """Reads ``i/n``; an empty text is the whole data set.

    Raises:
        EnvgenError: The text is not two whole numbers with 1 <= i <= n.
    """
    parts = (text or "1/1").split("/")
    if len(parts) == 2 and all(part.isascii() and part.isdigit() for part in parts):
        number, count = int(parts[0]), int(parts[1])
        if 1 <= number <= count:
            return number, count
    raise EnvgenError(f"--shard {text}: expected i/n with 1 <= i <= n, e.g. 1/4")
