"""Converts the .glb files of this folder to .fbx, which CARLA's import reads.

blender --background --python to_fbx.py
"""

from pathlib import Path

import bpy


def convert(path: Path) -> Path:
    """Writes the .fbx beside a .glb, with its textures inside."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=str(path))
    target = path.with_suffix(".fbx")
    bpy.ops.export_scene.fbx(
        filepath=str(target),
        object_types={"MESH"},
        mesh_smooth_type="FACE",
        path_mode="COPY",
        embed_textures=True,
        use_custom_props=False,
        bake_anim=False,
    )
    return target


if __name__ == "__main__":
    for file in sorted(Path(__file__).resolve().parent.glob("*.glb")):
        print(convert(file))
