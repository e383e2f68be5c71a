"""Opens a stage in Blender and renders it in Cycles. Runs with the Python that has `bpy`.

    python benchmarks/dcc_picture.py CAMERAS.usda FRAME IMAGE.exr [SAMPLES]

The stage is the layer `cameras.usda` of a run, whose first camera takes the picture. Prints as JSON
what arrived. `benchmarks/dcc.py` calls it and compares.
"""

import json
import sys
from collections import Counter

import bpy

WIDTH = 704
"""Pixels of a row; a larger value takes longer."""
THROUGH = (0.5, 0.5, 0.25)
"""Light that leaves let through, of what they reflect, as `LEAF` of `colour.frag`."""
SAMPLES = 24
"""Paths of a pixel before the noise is removed; a larger value takes longer."""


def import_stage(path: str) -> None:
    """Imports a stage into an empty scene."""
    # The sky becomes the light of the world, which an empty scene lacks.
    bpy.ops.wm.read_factory_settings()
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    bpy.ops.wm.usd_import(filepath=path)


def let_light_through(words: tuple[str, ...] = ("leaves", "needles", "hedge")) -> None:
    """Adds light through leaves, which UsdPreviewSurface cannot say, as the exporter draws it."""
    for material in bpy.data.materials:
        if not any(word in material.name for word in words) or not material.node_tree:
            continue
        nodes, links = material.node_tree.nodes, material.node_tree.links
        leaf = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
        out = next(node for node in nodes if node.type == "OUTPUT_MATERIAL")
        through, both = nodes.new("ShaderNodeBsdfTranslucent"), nodes.new("ShaderNodeAddShader")
        for link in list(leaf.inputs["Base Color"].links):
            share = nodes.new("ShaderNodeVectorMath")
            share.operation, share.inputs[1].default_value = "MULTIPLY", THROUGH
            links.new(link.from_socket, share.inputs[0])
            links.new(share.outputs["Vector"], through.inputs["Color"])
        links.new(leaf.outputs["BSDF"], both.inputs[0])
        links.new(through.outputs["BSDF"], both.inputs[1])
        surface = both
        for link in list(leaf.inputs["Alpha"].links):
            gap, cut = nodes.new("ShaderNodeBsdfTransparent"), nodes.new("ShaderNodeMixShader")
            links.new(link.from_socket, cut.inputs["Fac"])
            links.new(gap.outputs["BSDF"], cut.inputs[1])
            links.new(both.outputs["Shader"], cut.inputs[2])
            links.remove(link)
            leaf.inputs["Alpha"].default_value = 1.0
            surface = cut
        links.new(surface.outputs["Shader"], out.inputs["Surface"])


def what_arrived() -> dict[str, int]:
    """Numbers of objects, of which those of collections are counted once."""
    kinds = Counter(thing.type for thing in bpy.data.objects)
    instances = [thing for thing in bpy.data.objects if thing.instance_type == "COLLECTION"]
    textures = [image for image in bpy.data.images if image.source == "FILE"]
    missing = [image for image in textures if not image.has_data and not image.packed_file]
    for image in missing[:]:
        image.update()
        if image.size[0]:
            missing.remove(image)
    return {
        "meshes": len(bpy.data.meshes),
        "mesh objects": kinds["MESH"],
        "instances": len(instances),
        "materials": len(bpy.data.materials),
        "textures": len(textures),
        "missing textures": len(missing),
        "lights": kinds["LIGHT"] + (bpy.context.scene.world is not None),
        "cameras": kinds["CAMERA"],
        "properties": sum(thing.get("gml_id") is not None for thing in bpy.data.objects),
    }


def root(thing: bpy.types.Object) -> str:
    """Name of the outermost ancestor: the stage has cameras of its own below `World`."""
    while thing.parent:
        thing = thing.parent
    return thing.name


def render(frame: int, path: str, samples: int) -> None:
    """Renders a frame as linear RGB."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples = "CPU", samples
    scene.cycles.use_denoising = True
    scene.camera = next(
        thing for thing in bpy.data.objects if thing.type == "CAMERA" and root(thing) != "World"
    )
    scene.frame_set(frame)
    wide, tall = scene.camera.data.sensor_width, scene.camera.data.sensor_height
    scene.render.resolution_x = WIDTH
    scene.render.resolution_y = round(WIDTH * tall / wide)
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


def main() -> None:
    stage, frame, path = sys.argv[1:4]
    samples = int(sys.argv[4]) if len(sys.argv) > 4 else SAMPLES
    import_stage(stage)
    counts = what_arrived()
    let_light_through()
    render(int(frame), path, samples)
    print("RESULT", json.dumps(counts))


if __name__ == "__main__":
    main()
