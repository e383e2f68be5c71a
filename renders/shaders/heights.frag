#version 450 core
// Seen from above: red the tops of what stands on the ground, green the tops of leaves, and blue
// their undersides from below, 0 at the near end of the range. Blending keeps the least of each.
// Leaves are thinned (see draw_list.py) and whole.
layout(location = 0) out vec4 heights_out;

void main() {
    float depth = gl_FragCoord.z;
#ifdef CUT_OUT
    heights_out = vec4(1.0, depth, 1.0 - depth, 1.0);
#else
    heights_out = vec4(depth, 1.0, 1.0, 1.0);
#endif
}
