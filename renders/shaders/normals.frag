#version 450 core
// Unit normal of the triangle: x right, y down, z ahead.
#include "cut.glsl"
flat in vec3 face_normal;
in vec2 face_uv;
layout(location = 0) out vec4 normal_out;

void main() {
    cut_out(face_uv);
    normal_out = vec4(face_normal, 1.0);
}
