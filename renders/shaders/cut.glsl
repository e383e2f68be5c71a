uniform sampler2D colour_map;
uniform float threshold;  // least opacity at which a surface is there; 0 where it always is

bool is_cut(vec2 uv) {
    return threshold > 0.0 && texture(colour_map, uv).a < threshold;
}

// Share of a pixel's samples that a surface covers; one half where its label begins.
float coverage(vec2 uv) {
    if (threshold <= 0.0) return 1.0;
    float opacity = texture(colour_map, uv).a;
    return clamp((opacity - threshold) / max(fwidth(opacity), 1e-3) + 0.5, 0.0, 1.0);
}
