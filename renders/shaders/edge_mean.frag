#version 450 core
// Half the colour of a pixel's centre and an eighth of that of each corner; corners without a
// colour have the pixel's colour. Leaves, twigs and poles cover their share of a pixel instead.
#include "part.glsl"
layout(location = 0) out vec4 colour_out;

uniform sampler2D centres;
uniform sampler2D corners;  // alpha: 0 without a colour, else one more than the kind
uniform sampler2D pixel_depth;
uniform sampler2D corner_planes;  // inverse depth first

const float OPEN = 0.998;  // from this share on nothing covers a pixel
const int FAR_REACH = 10;  // pixels above, below and beside, for slender things
const float NEARER = 1.01;  // relative inverse depth of what hides leaves

// Colours by kind, and their weights. An array would lie in memory with software renderers.
struct Sums { vec4 whole, slender, leaves; };

void add(inout Sums sums, vec3 colour, int kind, float weight) {
    vec4 part = weight * vec4(colour, 1.0);
    sums.whole += kind == WHOLE ? part : vec4(0.0);
    sums.slender += kind == SLENDER ? part : vec4(0.0);
    sums.leaves += is_leaf(kind) ? part : vec4(0.0);
}

vec3 mean(vec4 sum) {
    return sum.rgb / max(sum.a, 1e-9);
}

// Colours of the pixels around, the nearer the more: none unless one is missing.
Sums colours_around(ivec2 pixel, bool missing, bool no_slender) {
    ivec2 last = textureSize(centres, 0) - 1;
    Sums around = Sums(vec4(0.0), vec4(0.0), vec4(0.0));
    for (int i = 0; i < (missing ? 16 : 0); ++i) {
        // The eight pixels around, and eight of the sixteen around these.
        ivec2 away = ivec2(i & 7, 0);
        away = away.x < 3 ? ivec2(away.x - 1, -1) : away.x < 6 ? ivec2(away.x - 4, 1)
            : ivec2(away.x * 2 - 13, 0);
        ivec2 place = clamp(pixel + (i < 8 ? 1 : 2) * away, ivec2(0), last);
        float weight = exp2(-float(dot(away, away)) * (i < 8 ? 1.0 : 4.0));
        add(around, texelFetch(centres, place, 0).rgb, kind_of(texelFetch(openness, place, 0)), weight);
    }
    // A thin pole that leans shows at centres of pixels farther up or down.
    int far_reach = no_slender && around.slender.a == 0.0 ? FAR_REACH : 0;
    for (int i = 3; i <= far_reach; ++i) {
        for (int turn = 0; turn < 4; ++turn) {
            ivec2 away = (turn < 2 ? ivec2(0, i) : ivec2(i, 0)) * ((turn & 1) * 2 - 1);
            ivec2 place = clamp(pixel + away, ivec2(0), last);
            bool shows = kind_of(texelFetch(openness, place, 0)) == SLENDER;
            float weight = shows ? exp2(-float(i)) : 0.0;
            around.slender += weight * vec4(texelFetch(centres, place, 0).rgb, 1.0);
        }
    }
    return around;
}

// The colour of a pixel that something covers in part.
vec3 mixed_colour(ivec2 pixel, vec3 centre, vec4 open) {
    int kind = kind_of(open);
    Sums own = Sums(vec4(0.0), vec4(0.0), vec4(0.0));
    add(own, centre, kind, 4.0);
    vec4 before = vec4(0.0);
    float inverse = is_leaf(kind) ? NEARER / texelFetch(pixel_depth, pixel, 0).r : 1e9;
    for (int i = 0; i < 4; ++i) {
        ivec2 place = pixel + ivec2(i & 1, i >> 1);
        vec4 corner = texelFetch(corners, place, 0);
        int shown = corner.a > 0.0 ? int(corner.a) - 1 : kind;
        vec3 colour = corner.a > 0.0 ? corner.rgb : centre;
        bool hides = !is_leaf(shown) && texelFetch(corner_planes, place, 0).r > inverse;
        if (hides) before += vec4(colour, 1.0); else add(own, colour, shown, 1.0);
    }
    // No sample of a pixel may show what covers a part of it, or what is behind: then colours of
    // pixels around count, the nearer the more.
    bool missing = own.whole.a == 0.0 && open.x * open.y > 1.0 - OPEN
        || own.slender.a == 0.0 && open.y < OPEN || own.leaves.a == 0.0 && open.x < OPEN;
    Sums around = colours_around(pixel, missing, own.slender.a == 0.0 && open.y < OPEN);
    if (own.whole.a == 0.0) own.whole = around.whole;
    if (own.slender.a == 0.0) own.slender = around.slender;
    if (own.leaves.a == 0.0) own.leaves = around.leaves;
    if (own.whole.a == 0.0) own.whole = own.leaves.a > 0.0 ? own.leaves : own.slender;
    if (own.slender.a == 0.0) own.slender = own.whole;
    if (own.leaves.a == 0.0) own.leaves = own.whole;
    vec3 whole = mean(own.whole), slender = mean(own.slender), leaves = mean(own.leaves);
    // The order of leaves and slender things is known where one stands at the centre.
    vec3 mixed = kind == SLENDER || kind == LEAF_BEFORE_SLENDER
        ? mix(leaves, mix(slender, mix(leaves, whole, open.x), open.y), open.z)
        : mix(leaves, mix(slender, whole, open.y), open.x);
    return mix(mixed, mean(before), before.a / 8.0);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 centre = texelFetch(centres, pixel, 0).rgb, sum = 4.0 * centre;
    for (int i = 0; i < 4; ++i) {
        vec4 corner = texelFetch(corners, pixel + ivec2(i & 1, i >> 1), 0);
        sum += corner.a > 0.0 ? corner.rgb : centre;
    }
    colour_out = vec4(sum / 8.0, 1.0);
    vec4 open = texelFetch(openness, pixel, 0);
    // A loop, as software renderers step through the code of branches that no pixel takes.
    int parts = min(open.x, open.y) < OPEN ? 1 : 0;
    for (int i = 0; i < parts; ++i) colour_out.rgb = mixed_colour(pixel, centre, open);
}
