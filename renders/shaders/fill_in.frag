#version 450 core
// The value of each pixel from those in each second row and column: of the four nearest, that with
// the most similar depth.
layout(location = 0) out vec2 share_out;

uniform sampler2D depth_map;
uniform sampler2D half_map;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), edge = textureSize(depth_map, 0) - 1;
    ivec2 low = pixel / 2, high = min(low + (pixel & 1), edge / 2);
    ivec2 places[4] = ivec2[](low, ivec2(high.x, low.y), ivec2(low.x, high.y), high);
    float depth = texelFetch(depth_map, pixel, 0).r, least = 1e30;
    ivec2 nearest = low;
    for (int i = 0; i < 4; ++i) {
        float apart = abs(texelFetch(depth_map, 2 * places[i], 0).r - depth);
        nearest = apart < least ? places[i] : nearest;
        least = min(least, apart);
    }
    share_out = texelFetch(half_map, nearest, 0).rg;
}
