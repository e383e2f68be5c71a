"""Content of an asset before it is written."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from envgen_usd.assets.polygon_mesh import Mesh, set_apart
from envgen_usd.models.array_types import FloatArray, IntArray


@dataclass(frozen=True)
class Subset:
    """Faces of a mesh with a material and a label of their own.

    Attributes:
        name: Name of its prim.
        faces: Numbers of the faces; the subsets of a mesh hold each face once.
        material: Default material in the library; a look names the subset ``<part>/<subset>``.
        label: Token in the `part` taxonomy.
        of_class: Token in the `class` taxonomy if it differs from the asset's.
    """

    name: str
    faces: IntArray
    material: str
    label: str
    of_class: str = ""


@dataclass(frozen=True)
class Part:
    """A mesh of an asset.

    Attributes:
        name: Name of its prim.
        mesh: Geometry.
        material: Default material in the library; variants may override it.
        label: Token in the `part` taxonomy.
        double_sided: True for thin sheets, e.g. leaves.
        of_class: Token in the `class` taxonomy if it differs from the asset's, e.g. of a sign's
            face.
        proxy_of: Name of the part that this simpler part replaces at a distance.
        stands_for: Names of further parts that it replaces; all change level together.
        subsets: Faces with materials of their own.
    """

    name: str
    mesh: Mesh
    material: str
    label: str
    double_sided: bool = False
    of_class: str = ""
    proxy_of: str = ""
    stands_for: tuple[str, ...] = ()
    subsets: tuple[Subset, ...] = ()


@dataclass(frozen=True)
class Lamp:
    """A light of an asset.

    Attributes:
        name: Name of its prim.
        place: x, y, z, metres.
        radius: Radius of the sphere, or of the disk that faces down, metres.
        flux: Luminous flux, lumens.
        colour: Linear RGB of luminance 1.
        faces_down: True for a disk.
    """

    name: str
    place: tuple[float, float, float]
    radius: float
    flux: float
    colour: tuple[float, float, float]
    faces_down: bool

    def luminance(self) -> float:
        """Luminance of its surface, kcd/m²."""
        area = np.pi * self.radius**2
        # A Lambertian disk sends pi times its luminance times its area, a sphere four times that.
        return self.flux / 1000.0 / (np.pi * area * (1.0 if self.faces_down else 4.0))


@dataclass(frozen=True)
class Model:
    """A geometry of an asset.

    Attributes:
        parts: Its meshes; their base lies on z = 0.
        lamps: Its lights.
        nominal: Extent along x, y, z in metres that scaling refers to, if it differs from the
            extent of the meshes.
        custom: Further figures for `customData` by name, e.g. the length of a stride, metres; an
            array is N x 3.
    """

    parts: tuple[Part, ...]
    nominal: tuple[float, float, float] | None = None
    lamps: tuple[Lamp, ...] = ()
    custom: Mapping[str, float | FloatArray] = field(default_factory=dict)

    def extent(self) -> FloatArray:
        """2 x 3, bounding box of the meshes without proxies, metres."""
        boxes = np.stack([part.mesh.extent() for part in self.parts if not part.proxy_of])
        return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])

    def size(self) -> tuple[float, float, float]:
        """Nominal extent along x, y, z, metres."""
        if self.nominal is not None:
            return self.nominal
        low, high = self.extent()
        x, y, _ = np.round(high - low, 3).tolist()
        return x, y, round(float(high[2]), 3)


def parted_model(model: Model) -> Model:
    """The model whose pieces nowhere share a vertex, see `polygon_mesh.set_apart`."""
    parts = tuple(replace(part, mesh=set_apart(part.mesh)) for part in model.parts)
    return replace(model, parts=parts)


@dataclass(frozen=True)
class AssetDesign:
    """An asset with its variants.

    Attributes:
        name: Name of the asset, its folder and its file.
        kind: Kind of object: ``tree``, ``street_light``, ``window``, ...
        label: Token in the `class` taxonomy.
        models: Geometries by variant of the set `model_set`, default first; a single geometry with
            an empty name without that set.
        model_set: Variant set of the geometry; empty for a single geometry.
        looks: Variant sets of materials: set, variant (default first), part to material. An empty
            material hides the part.
        countries: Countries of the asset; empty means all countries.
        areas: Area types of the asset; empty means all area types.
        widths: Least and largest width to which it may be scaled, metres, or `None`.
        has_poses: True if the models are poses of one body, which share a payload file.
    """

    name: str
    kind: str
    label: str
    models: Mapping[str, Model]
    model_set: str = ""
    looks: Mapping[str, Mapping[str, Mapping[str, str]]] = field(default_factory=dict)
    countries: tuple[str, ...] = ()
    areas: tuple[str, ...] = ()
    widths: tuple[float, float] | None = None
    has_poses: bool = False
