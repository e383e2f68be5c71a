// Tells what the nearest surface of a pixel is.
uniform sampler2D nearest_depth;  // of all surfaces, as in the depth buffer
uniform sampler2D slender_depth;  // of all without gaps
uniform sampler2D whole_depth;  // of those that are not slender either

const int WHOLE = 0, SLENDER = 1, LEAF = 2;

int kind_at(ivec2 pixel) {
    float depth = texelFetch(nearest_depth, pixel, 0).r;
    if (depth == texelFetch(whole_depth, pixel, 0).r) return WHOLE;
    return depth == texelFetch(slender_depth, pixel, 0).r ? SLENDER : LEAF;
}

bool has_slender(ivec2 pixel) {
    return texelFetch(slender_depth, pixel, 0).r != texelFetch(whole_depth, pixel, 0).r;
}
