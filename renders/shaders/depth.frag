#version 450 core
// Depth only.
#include "cut.glsl"
in vec2 texture_uv;

void main() {
    if (is_cut(texture_uv)) discard;
}
