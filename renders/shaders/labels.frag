#version 450 core
// Scene object, instance (0 in the sky) and depth at each pixel's centre: one sample, no blending.
// With PLANES, the inverse depth and its change by a pixel in x and y replace the depth.
#include "cut.glsl"
in vec2 texture_uv;
flat in uint scene_object;
flat in uint instance_number;
layout(location = 0) out uvec2 label_out;
#ifdef PLANES
layout(location = 1) out vec4 plane_out;
#else
layout(location = 1) out float depth_out;
#endif

void main() {
    cut_out(texture_uv);
    label_out = uvec2(scene_object, instance_number + 1u);
#ifdef PLANES
    plane_out = vec4(gl_FragCoord.w, dFdx(gl_FragCoord.w), dFdy(gl_FragCoord.w), 0.0);
#else
    depth_out = 1.0 / gl_FragCoord.w;
#endif
}
