#version 450 core
// Averages four by four of the pixels in each second row and column that have a similar depth.
layout(location = 0) out vec2 share_out;

uniform sampler2D depth_map;
uniform sampler2D rough_map;

void main() {
    ivec2 middle = ivec2(gl_FragCoord.xy);
    ivec2 last = textureSize(rough_map, 0) - 1, edge = textureSize(depth_map, 0) - 1;
    float depth = texelFetch(depth_map, min(2 * middle, edge), 0).r;
    // At the border, too, sixteen pixels: each looks into other directions.
    ivec2 low = max(min(middle - 2, last - 3), ivec2(0));
    vec3 sum = vec3(0.0);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) {
            ivec2 other = min(low + ivec2(x, y), last);
            float apart = abs(texelFetch(depth_map, min(2 * other, edge), 0).r - depth);
            float weight = apart < 0.05 + 0.05 * depth ? 1.0 : 0.001;
            sum += weight * vec3(texelFetch(rough_map, other, 0).rg, 1.0);
        }
    share_out = sum.rg / sum.b;
}
