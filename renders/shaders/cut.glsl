// Discards the fragments that a material cuts out. Opaque materials have a program without the
// test: software renderers then need no texture coordinates and write depth before the shader.
#ifdef CUT_OUT
uniform sampler2D colour_map;
uniform float threshold;  // least opacity of a visible surface

void cut_out(vec2 uv) {
    if (texture(colour_map, uv).a < threshold) discard;
}
#else
void cut_out(vec2 uv) {}
#endif
