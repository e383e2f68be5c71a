uniform sampler2D colour_map;
uniform float threshold;

// Opacity where there is a cut-out; fragments below the threshold are not there.
float cut_opacity(vec2 uv) {
    return texture(colour_map, uv).a;
}
