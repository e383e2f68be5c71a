"""What an asset consists of, before it is written."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from envgen_usd.assets.mesh import Mesh
from envgen_usd.models.arrays import FloatArray


@dataclass(frozen=True)
class Part:
    """One mesh of an asset.

    Attributes:
        name: Name of its prim.
        mesh: Geometry.
        material: Material of the library that it has where no variant says otherwise.
        label: Token in the `part` taxonomy.
        double_sided: True for sheets without a back, e.g. leaves.
        of_class: Token in the `class` taxonomy where it is not the asset's, e.g. a sign's face.
        proxy_of: Name of the part in whose place this simpler one is drawn from afar.
    """

    name: str
    mesh: Mesh
    material: str
    label: str
    double_sided: bool = False
    of_class: str = ""
    proxy_of: str = ""


@dataclass(frozen=True)
class Model:
    """One geometry of an asset.

    Attributes:
        parts: Its meshes; they stand on z = 0.
        nominal: Extent along x, y, z in metres to which a requested size relates, where that is
            not the extent of the meshes.
    """

    parts: tuple[Part, ...]
    nominal: tuple[float, float, float] | None = None

    def extent(self) -> FloatArray:
        """2 x 3, the box around the meshes, proxies left out."""
        boxes = np.stack([part.mesh.extent() for part in self.parts if not part.proxy_of])
        return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])

    def size(self) -> tuple[float, float, float]:
        """Nominal extent along x, y, z."""
        if self.nominal is not None:
            return self.nominal
        low, high = self.extent()
        x, y, _ = np.round(high - low, 3).tolist()
        return x, y, round(float(high[2]), 3)


@dataclass(frozen=True)
class AssetDesign:
    """An asset with its variants.

    Attributes:
        name: Name of the asset, its folder and its file.
        kind: Kind of thing that it shows: ``tree``, ``street_light``, ``window``, ...
        label: Token in the `class` taxonomy.
        models: Geometries, by variant of the set `model_set`, the default one first; one geometry
            under an empty name where there is no such set.
        model_set: Variant set that chooses the geometry, empty where there is only one.
        looks: Variant sets that choose materials: set, variant (the default one first), part to
            material. An empty material takes the part away.
        countries: Where it belongs; empty for anywhere.
        areas: Area types where it belongs; empty for any.
        widths: Least and greatest width in metres to which it may be scaled, where that matters.
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
