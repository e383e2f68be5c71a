#version 450 core
// The share of a pixel's samples that are open, in the second channel; the others are for leaves.
layout(location = 0) out vec4 open_out;

uniform sampler2D samples;

void main() {
    ivec2 first = ivec2(gl_FragCoord.xy) * SAMPLES;
    float sum = 0.0;
    for (int y = 0; y < SAMPLES; ++y) {
        for (int x = 0; x < SAMPLES; ++x) sum += texelFetch(samples, first + ivec2(x, y), 0).r;
    }
    open_out = vec4(1.0, sum / float(SAMPLES * SAMPLES), 1.0, 1.0);
}
