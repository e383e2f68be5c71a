#version 450 core
// What each pixel's centre shows, and how far away it is. One sample, no blending.
#include "cut.glsl"
in vec2 texture_uv;
flat in uint thing;
layout(location = 0) out uint thing_out;
layout(location = 1) out float depth_out;

void main() {
    if (is_cut(texture_uv)) discard;
    thing_out = thing;
    depth_out = 1.0 / gl_FragCoord.w;
}
