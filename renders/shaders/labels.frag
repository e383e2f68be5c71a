#version 450 core
// Scene object and depth at each pixel's centre. A single sample, no blending.
#include "cut.glsl"
in vec2 texture_uv;
flat in uint scene_object;
layout(location = 0) out uint object_out;
layout(location = 1) out float depth_out;

void main() {
    if (is_cut(texture_uv)) discard;
    object_out = scene_object;
    depth_out = 1.0 / gl_FragCoord.w;
}
