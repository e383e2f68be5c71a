#version 450 core
// Begins the open shares: those of slender things in the second channel, ones for leaves, and the
// kind of the nearest surface.
#include "part.glsl"
layout(location = 0) out vec4 open_out;

uniform sampler2D samples;
uniform sampler2D nearest_depth;  // of all surfaces, as in the depth buffer
uniform sampler2D slender_depth;  // of all without gaps
uniform sampler2D whole_depth;  // of those that are not slender either

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), first = pixel * SAMPLES;
    float sum = 0.0;
    for (int y = 0; y < SAMPLES; ++y) {
        for (int x = 0; x < SAMPLES; ++x) sum += texelFetch(samples, first + ivec2(x, y), 0).r;
    }
    float nearest = texelFetch(nearest_depth, pixel, 0).r;
    float slender = texelFetch(slender_depth, pixel, 0).r;
    float whole = texelFetch(whole_depth, pixel, 0).r;
    int kind = nearest == whole ? WHOLE : nearest == slender ? SLENDER
        : slender == whole ? LEAF : LEAF_BEFORE_SLENDER;
    open_out = vec4(1.0, sum / float(SAMPLES * SAMPLES), 1.0, float(kind) / KINDS);
}
