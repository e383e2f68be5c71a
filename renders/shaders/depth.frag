#version 450 core
// Depth of every sample, so that colours are worked out for what is seen only.
#include "cut.glsl"
in vec2 texture_uv;
layout(location = 0) out vec4 colour_out;

void main() {
    colour_out = vec4(0.0, 0.0, 0.0, coverage(texture_uv));
}
