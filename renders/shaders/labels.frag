#version 450 core
// Scene object, instance (0 in the sky) and depth at each pixel's centre: one sample, no blending.
#include "cut.glsl"
in vec2 texture_uv;
flat in uint scene_object;
flat in uint instance_number;
layout(location = 0) out uvec2 label_out;
layout(location = 1) out float depth_out;

void main() {
    cut_out(texture_uv);
    label_out = uvec2(scene_object, instance_number + 1u);
    depth_out = 1.0 / gl_FragCoord.w;
}
