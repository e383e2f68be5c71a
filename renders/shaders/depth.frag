#version 450 core
// Nothing but depth.
#include "cut.glsl"
in vec2 texture_uv;

void main() {
    if (is_cut(texture_uv)) discard;
}
