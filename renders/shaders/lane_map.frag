#version 450 core
// The lane nearest to each texel, on the level of the camera where roads cross above each other.
in vec3 ribbon_lane;
flat in vec2 ribbon_direction;
layout(location = 0) out uvec4 stored;

void main() {
    stored = uvec4(floatBitsToUint(ribbon_lane.xy), packHalf2x16(ribbon_direction),
        floatBitsToUint(ribbon_lane.z));
    gl_FragDepth = clamp((abs(ribbon_lane.y) + abs(ribbon_lane.z + 1.5)) / 200.0, 0.0, 0.999);
}
