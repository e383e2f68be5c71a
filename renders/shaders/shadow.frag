#version 450 core
#include "cut.glsl"
in vec2 texture_uv;

void main() {
    if (threshold > 0.0 && cut_opacity(texture_uv) < threshold) discard;
}
