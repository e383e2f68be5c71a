#version 450 core
// Marks the samples of pixels that poles, stems and bars cover, in an image of SAMPLES x SAMPLES
// samples a pixel, in front of the nearest surface that covers whole pixels.
layout(location = 0) out vec4 open_out;

uniform sampler2D whole_depth;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy) / SAMPLES;
    if (gl_FragCoord.z < texelFetch(whole_depth, pixel, 0).r) discard;
    open_out = vec4(0.0);
}
