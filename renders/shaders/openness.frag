#version 450 core
// The share of a pixel that a surface covers. Blending multiplies what all surfaces in front of the
// nearest one without gaps leave open, in any order.
#include "cut.glsl"
in vec2 texture_uv;
layout(location = 0) out vec4 share_out;

void main() {
    share_out = vec4(covered(texture_uv));
}
