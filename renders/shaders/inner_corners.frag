#version 450 core
// Closes the depth buffer at corners of pixels within a flat surface, which need no sample.
layout(depth_any) out float gl_FragDepth;

uniform usampler2D pixel_labels;
uniform sampler2D pixel_depth;
uniform usampler2D corner_labels;
uniform sampler2D corner_depth;

const float BEND = 0.0005;  // relative difference of depth to that of a plane; 15 degrees of a fold

float inverse(float depth) {
    return depth > 0.0 ? 1.0 / depth : 0.0;
}

void main() {
    ivec2 corner = ivec2(gl_FragCoord.xy);
    ivec2 low = max(corner - 1, ivec2(0));
    ivec2 high = min(corner, textureSize(pixel_depth, 0) - 1);
    ivec2 places[4] = ivec2[](low, ivec2(high.x, low.y), ivec2(low.x, high.y), high);
    uvec2 label = texelFetch(corner_labels, corner, 0).rg;
    float middle = inverse(texelFetch(corner_depth, corner, 0).r);
    float around[4];
    bool same = true;
    for (int i = 0; i < 4; ++i) {
        same = same && texelFetch(pixel_labels, places[i], 0).rg == label;
        around[i] = inverse(texelFetch(pixel_depth, places[i], 0).r);
    }
    // The inverse depth of a plane is linear in the image.
    float limit = BEND * middle;
    float twist = abs(around[0] + around[3] - around[1] - around[2]);
    float bulge = abs(0.25 * (around[0] + around[1] + around[2] + around[3]) - middle);
    if (!same || twist > limit || bulge > limit) discard;
    gl_FragDepth = 1.0;
}
