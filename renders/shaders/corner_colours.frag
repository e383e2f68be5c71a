#version 450 core
// The colour of each corner of pixels: that of the pixel beside it which shows the same surface.
// Alpha is 0 within a flat surface, and where no pixel beside it shows the corner's surface; else
// it is one more than the kind of the surface.
#include "part.glsl"
layout(location = 0) out vec4 colour_out;

uniform usampler2D pixel_labels;
uniform sampler2D pixel_depth;
uniform usampler2D corner_labels;
uniform sampler2D corner_planes;  // inverse depth, and its change by a pixel in x and y
uniform sampler2D colours;

const float BEND = 0.0005;  // relative difference of inverse depth within a flat surface
const float OTHER = 1e3;  // more than any difference of inverse depth

void main() {
    ivec2 corner = ivec2(gl_FragCoord.xy), last = textureSize(pixel_depth, 0) - 1;
    ivec2 low = max(corner - 1, ivec2(0)), high = min(corner, last);
    uvec2 label = texelFetch(corner_labels, corner, 0).rg;
    vec3 plane = texelFetch(corner_planes, corner, 0).rgb;
    // The four pixels in the order of textureGather: upper left, upper right, lower right, lower left.
    vec2 between = vec2(corner) / vec2(last + 1);
    vec4 depths = textureGather(pixel_depth, between);
    uvec4 objects = textureGather(pixel_labels, between, 0);
    uvec4 instances = textureGather(pixel_labels, between, 1);
    // The inverse depth of a plane is linear in the image; that of the sky is 0.
    vec4 across = plane.y * vec4(-0.5, 0.5, 0.5, -0.5), up = plane.z * vec4(0.5, 0.5, -0.5, -0.5);
    vec4 inverse = mix(vec4(0.0), 1.0 / depths, greaterThan(depths, vec4(0.0)));
    vec4 apart = abs(inverse - (plane.x + across + up));
    apart += OTHER * vec4(notEqual((objects ^ label.r) | (instances ^ label.g), uvec4(0u)));
    float least = min(min(apart.x, apart.y), min(apart.z, apart.w));
    float most = max(max(apart.x, apart.y), max(apart.z, apart.w));
    ivec2 nearest = apart.w == least ? low : apart.z == least ? ivec2(high.x, low.y)
        : apart.x == least ? ivec2(low.x, high.y) : high;
    // A thin surface may lie between the four pixels: then one of the eight beside them. A loop
    // with a fixed end would run for all pixels.
    int tries = least >= OTHER ? 8 : 0;
    for (int i = 0; i < tries; ++i) {
        ivec2 away = ivec2((i & 1) * 3 - 2, (i >> 1 & 1) - 1);
        ivec2 place = clamp(corner + (i < 4 ? away : away.yx), ivec2(0), last);
        if (texelFetch(pixel_labels, place, 0).rg == label) {
            nearest = place;
            least = 0.0;
            tries = 0;
        }
    }
    float known = least < OTHER && most > BEND * plane.x ? 1.0 : 0.0;
    if (known > 0.0) known += float(kind_of(texelFetch(openness, nearest, 0)));
    colour_out = vec4(texelFetch(colours, nearest, 0).rgb, known);
}
