// Discards the fragments that a material cuts out. Opaque materials have a program without the
// test: software renderers then need no texture coordinates and write depth before the shader.
#ifdef CUT_OUT
uniform sampler2D colour_map;  // smaller levels hold the share of visible texels as opacity
uniform float threshold;  // least opacity of a visible surface

// A number for each half pixel of a surface, 0 to 1; it stays with the surface.
float grain(vec2 uv, float level) {
    vec2 cells = vec2(textureSize(colour_map, 0)) * exp2(1.0 - ceil(level));
    uvec2 cell = uvec2(ivec2(floor(uv * cells)));
    uint n = cell.x * 1597334677u ^ cell.y * 3812015801u;
    n = (n ^ (n >> 15)) * 2246822519u;
    n = (n ^ (n >> 13)) * 3266489917u;
    return (float((n ^ (n >> 16)) & 0xffffffu) + 1.0) / 16777217.0;
}

const float LINES = 4.0;  // level up to which twigs are lines rather than grains
const float LINE_SHARE = 0.4;  // share of a pixel that a line covers to be drawn whole

// Where texels are smaller than pixels, a surface is visible in as many samples as the share of its
// visible texels: C. Wyman and M. McGuire, "Hashed alpha testing" (2017).
bool is_cut(vec2 uv) {
    float level = max(textureQueryLod(colour_map, uv).y, 0.0);
    float limit = mix(LINE_SHARE, grain(uv, level), clamp(level / LINES, 0.0, 1.0));
    return textureLod(colour_map, uv, level).a < mix(threshold, limit, min(level, 1.0));
}

const float EMPTY = 0.004;  // share of visible texels that counts as none

// Share of a pixel that the surface covers: the mean of its two halves along the longer side of its
// image in the texture, as the level of a whole pixel would blur twigs. Where texels are larger than
// pixels, the edge between visible and open ones is a pixel wide. Whole levels, 1.5 finer in the mean:
// between two of them, software renderers look both up.
float covered(vec2 uv) {
    vec2 across = dFdx(uv), up = dFdy(uv);
    vec2 quarter = 0.25 * (dot(across, across) > dot(up, up) ? across : up);
    float level = textureQueryLod(colour_map, uv).y, finer = floor(max(level - 1.0, 0.0));
    // Empty surroundings are not looked up: a loop, as software renderers step through branches.
    int ends = level > 1.0 && textureLod(colour_map, uv, floor(level + 1.5)).a < EMPTY ? 0 : 2;
    float opacity = 0.0;
    for (int i = 0; i < ends; ++i) {
        opacity += 0.5 * textureLod(colour_map, uv + (i == 0 ? quarter : -quarter), finer).a;
    }
    float edge = (opacity - threshold) / max(fwidth(opacity), 1e-3) + 0.5;
    return mix(clamp(edge, 0.0, 1.0), opacity, clamp(level, 0.0, 1.0));
}

#ifdef OUTLINES
const float WIDER = 1.5;  // levels by which a gap may be wider than a pixel
const float FAIR_SHARE = 0.055;  // least share of visible texels around a gap

// People who label a crown outline it, and count narrow gaps to it.
bool is_open(vec2 uv) {
    float level = textureQueryLod(colour_map, uv).y;
    return level <= 0.0 || textureLod(colour_map, uv, level + WIDER).a < FAIR_SHARE;
}
#else
bool is_open(vec2 uv) { return true; }
#endif

void cut_out(vec2 uv) {
    if (is_cut(uv) && is_open(uv)) discard;
}
#else
float covered(vec2 uv) { return 1.0; }
void cut_out(vec2 uv) {}
#endif
