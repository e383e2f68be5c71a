#version 450 core
// Unit normal of the triangle that labels and depth show: x right, y down, z ahead.
uniform sampler2D labelled_depth;  // metres along the optical axis; 0 in the sky
flat in vec3 face_normal;
layout(location = 0) out vec4 normal_out;

const float SAME = 1e-4;  // largest relative difference of the depths of one surface

void main() {
    float depth = texelFetch(labelled_depth, ivec2(gl_FragCoord.xy), 0).r;
    if (depth <= 0.0 || abs(depth * gl_FragCoord.w - 1.0) > SAME) discard;
    normal_out = vec4(face_normal, 1.0);
}
