uniform sampler2D colour_map;
uniform float threshold;  // least opacity of a visible surface; 0 disables the test

bool is_cut(vec2 uv) {
    return threshold > 0.0 && texture(colour_map, uv).a < threshold;
}
