#version 450 core
// The share of a pixel that a surface covers: all of it, and what lies before the slender things at
// the pixel's centre. Blending multiplies what all surfaces in front of the nearest whole one leave
// open, in any order; the second channel and the fourth stay.
#include "cut.glsl"
in vec2 texture_uv;
layout(location = 0) out vec4 share_out;

uniform sampler2D slender_depth;

void main() {
    float share = covered(texture_uv);
    if (share == 0.0) discard;
    float nearest = texelFetch(slender_depth, ivec2(gl_FragCoord.xy), 0).r;
    share_out = vec4(share, 0.0, gl_FragCoord.z > nearest ? share : 0.0, 0.0);
}
