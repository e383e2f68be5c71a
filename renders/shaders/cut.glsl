uniform sampler2D colour_map;
uniform float threshold;  // least opacity at which a surface is there; 0 where it always is

bool is_cut(vec2 uv) {
    return threshold > 0.0 && texture(colour_map, uv).a < threshold;
}
