#version 450 core
// Half the colour of a pixel's centre and an eighth of that of each corner; corners without a
// colour have the pixel's colour. Leaves, twigs and poles cover their share of a pixel instead.
#include "part.glsl"
layout(location = 0) out vec4 colour_out;

uniform sampler2D centres;
uniform sampler2D corners;  // alpha: 0 without a colour, else one more than the kind
uniform sampler2D openness;  // see partial_cover.py: all leaves, slender things, leaves before them
uniform sampler2D pixel_depth;
uniform sampler2D corner_planes;  // inverse depth first

const float OPEN = 0.998;  // from this share on nothing covers a pixel
const int REACH = 2;  // pixels around, among which a missing colour is looked for
const int FAR_REACH = 10;  // pixels above, below and beside, for slender things
const float NEARER = 1.01;  // relative inverse depth of what hides leaves

// Colours by kind, and their weights. An array would lie in memory with software renderers.
struct Sums { vec4 whole, slender, leaves; };

void add(inout Sums sums, vec3 colour, int kind, float weight) {
    vec4 part = weight * vec4(colour, 1.0);
    sums.whole += kind == WHOLE ? part : vec4(0.0);
    sums.slender += kind == SLENDER ? part : vec4(0.0);
    sums.leaves += kind == LEAF ? part : vec4(0.0);
}

vec3 mean(vec4 sum) {
    return sum.rgb / max(sum.a, 1e-9);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(centres, 0) - 1;
    vec3 centre = texelFetch(centres, pixel, 0).rgb;
    vec3 open = texelFetch(openness, pixel, 0).rgb;
    if (min(open.x, open.y) >= OPEN) {
        vec3 sum = 4.0 * centre;
        for (int i = 0; i < 4; ++i) {
            vec4 corner = texelFetch(corners, pixel + ivec2(i & 1, i >> 1), 0);
            sum += corner.a > 0.0 ? corner.rgb : centre;
        }
        colour_out = vec4(sum / 8.0, 1.0);
        return;
    }
    int kind = kind_at(pixel);
    Sums own = Sums(vec4(0.0), vec4(0.0), vec4(0.0));
    add(own, centre, kind, 4.0);
    vec4 before = vec4(0.0);
    float inverse = kind == LEAF ? NEARER / texelFetch(pixel_depth, pixel, 0).r : 1e9;
    for (int i = 0; i < 4; ++i) {
        ivec2 place = pixel + ivec2(i & 1, i >> 1);
        vec4 corner = texelFetch(corners, place, 0);
        int shown = corner.a > 0.0 ? int(corner.a) - 1 : kind;
        vec3 colour = corner.a > 0.0 ? corner.rgb : centre;
        bool hides = shown != LEAF && texelFetch(corner_planes, place, 0).r > inverse;
        if (hides) before += vec4(colour, 1.0); else add(own, colour, shown, 1.0);
    }
    // No sample of a pixel may show what covers a part of it, or what is behind: then colours of
    // pixels around count, the nearer the more.
    bool missing = own.whole.a == 0.0 && open.x * open.y > 1.0 - OPEN
        || own.slender.a == 0.0 && open.y < OPEN || own.leaves.a == 0.0 && open.x < OPEN;
    int reach = missing ? REACH : -1;
    Sums around = Sums(vec4(0.0), vec4(0.0), vec4(0.0));
    for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
            ivec2 place = clamp(pixel + ivec2(x, y), ivec2(0), last);
            float weight = exp2(-float(x * x + y * y));
            add(around, texelFetch(centres, place, 0).rgb, kind_at(place), weight);
        }
    }
    // A thin pole that leans shows at centres of pixels farther up or down.
    int far_reach = own.slender.a + around.slender.a == 0.0 && open.y < OPEN ? FAR_REACH : 0;
    for (int i = REACH + 1; i <= far_reach; ++i) {
        for (int turn = 0; turn < 4; ++turn) {
            ivec2 away = (turn < 2 ? ivec2(0, i) : ivec2(i, 0)) * ((turn & 1) * 2 - 1);
            ivec2 place = clamp(pixel + away, ivec2(0), last);
            float weight = kind_at(place) == SLENDER ? exp2(-float(i)) : 0.0;
            around.slender += weight * vec4(texelFetch(centres, place, 0).rgb, 1.0);
        }
    }
    if (own.whole.a == 0.0) own.whole = around.whole;
    if (own.slender.a == 0.0) own.slender = around.slender;
    if (own.leaves.a == 0.0) own.leaves = around.leaves;
    if (own.whole.a == 0.0) own.whole = own.leaves.a > 0.0 ? own.leaves : own.slender;
    if (own.slender.a == 0.0) own.slender = own.whole;
    if (own.leaves.a == 0.0) own.leaves = own.whole;
    vec3 whole = mean(own.whole), slender = mean(own.slender), leaves = mean(own.leaves);
    // The order of leaves and slender things is known where one stands at the centre.
    vec3 mixed = has_slender(pixel)
        ? mix(leaves, mix(slender, mix(leaves, whole, open.x), open.y), open.z)
        : mix(leaves, mix(slender, whole, open.y), open.x);
    colour_out = vec4(mix(mixed, mean(before), before.a / 8.0), 1.0);
}
