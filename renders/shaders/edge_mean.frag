#version 450 core
// Half the colour of a pixel's centre and an eighth of that of each corner; corners without a
// colour have the pixel's colour. Surfaces with gaps cover their share of a pixel instead.
layout(location = 0) out vec4 colour_out;

uniform sampler2D centres;  // alpha below 0: the surface has gaps
uniform sampler2D corners;
uniform sampler2D openness;  // share of a pixel that surfaces with gaps leave open
uniform sampler2D pixel_depth;
uniform sampler2D corner_planes;  // inverse depth first

const float OPEN = 0.998;  // from this share on nothing covers a pixel
const int REACH = 3;  // pixels around, among which a missing colour is looked for
const float NEARER = 1.01;  // relative inverse depth of what hides a crown

// Adds a colour to the sum of leaves or to that of what is behind them.
void add(vec4 colour, float weight, inout vec4 leaves, inout vec4 behind) {
    vec4 part = weight * vec4(colour.rgb, 1.0);
    if (colour.a < 0.0) leaves += part; else behind += part;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(centres, 0) - 1;
    vec4 centre = texelFetch(centres, pixel, 0);
    float open = texelFetch(openness, pixel, 0).r;
    float inverse = centre.a < 0.0 ? NEARER / texelFetch(pixel_depth, pixel, 0).r : 1e9;
    vec4 leaves = vec4(0.0), behind = vec4(0.0), before = vec4(0.0);
    add(centre, 4.0, leaves, behind);
    vec4 plain = vec4(4.0 * centre.rgb, 4.0);
    for (int i = 0; i < 4; ++i) {
        ivec2 place = pixel + ivec2(i & 1, i >> 1);
        vec4 corner = texelFetch(corners, place, 0);
        if (corner.a == 0.0) corner = centre;
        plain += vec4(corner.rgb, 1.0);
        bool hides = corner.a > 0.0 && texelFetch(corner_planes, place, 0).r > inverse;
        if (hides) before += vec4(corner.rgb, 1.0); else add(corner, 1.0, leaves, behind);
    }
    if (open >= OPEN) {
        colour_out = vec4(plain.rgb / plain.a, 1.0);
        return;
    }
    // Random gaps show either leaves or what is behind them: the other colour is that of pixels
    // around, the nearer the more.
    float missing = min(leaves.a, behind.a) > 0.0 ? 0.0 : 1.0;
    int reach = missing > 0.0 ? REACH : -1;
    vec4 near_leaves = vec4(0.0), near_behind = vec4(0.0);
    for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
            ivec2 place = clamp(pixel + ivec2(x, y), ivec2(0), last);
            float weight = exp2(-float(x * x + y * y));
            add(texelFetch(centres, place, 0), weight, near_leaves, near_behind);
        }
    }
    if (leaves.a == 0.0) leaves = near_leaves.a > 0.0 ? near_leaves : behind;
    if (behind.a == 0.0) behind = near_behind.a > 0.0 ? near_behind : leaves;
    vec3 crown = mix(leaves.rgb / leaves.a, behind.rgb / behind.a, open);
    colour_out = vec4(mix(crown, before.rgb / max(before.a, 1.0), before.a / 8.0), 1.0);
}
