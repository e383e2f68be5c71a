#version 450 core
// Depth only.
#include "cut.glsl"
in vec2 texture_uv;

void main() {
    cut_out(texture_uv);
}
