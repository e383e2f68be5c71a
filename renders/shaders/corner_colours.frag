#version 450 core
// The colour of each corner of pixels: that of the pixel beside it which shows the same surface.
// Alpha is 0 within a flat surface, and where no pixel beside it shows the corner's surface.
layout(location = 0) out vec4 colour_out;

uniform usampler2D pixel_labels;
uniform sampler2D pixel_depth;
uniform usampler2D corner_labels;
uniform sampler2D corner_planes;  // inverse depth, and its change by a pixel in x and y
uniform sampler2D colours;

const float BEND = 0.0005;  // relative difference of inverse depth within a flat surface
const float OTHER = 1e3;  // more than any difference of inverse depth

float inverse(float depth) {
    return depth > 0.0 ? 1.0 / depth : 0.0;
}

void main() {
    ivec2 corner = ivec2(gl_FragCoord.xy);
    ivec2 low = max(corner - 1, ivec2(0));
    ivec2 last = textureSize(pixel_depth, 0) - 1, high = min(corner, last);
    ivec2 places[4] = ivec2[](low, ivec2(high.x, low.y), ivec2(low.x, high.y), high);
    uvec2 label = texelFetch(corner_labels, corner, 0).rg;
    vec3 plane = texelFetch(corner_planes, corner, 0).rgb;
    ivec2 nearest = low;
    float least = 2.0 * OTHER, most = 0.0;
    for (int i = 0; i < 4; ++i) {
        // The inverse depth of a plane is linear in the image.
        float expected = plane.x + dot(plane.yz, vec2(places[i] - corner) + 0.5);
        float apart = abs(inverse(texelFetch(pixel_depth, places[i], 0).r) - expected);
        if (texelFetch(pixel_labels, places[i], 0).rg != label) apart += OTHER;
        nearest = apart < least ? places[i] : nearest;
        least = min(least, apart);
        most = max(most, apart);
    }
    // A thin surface may lie between the four pixels: then one of the eight beside them.
    for (int i = 0; least >= OTHER && i < 8; ++i) {
        ivec2 away = ivec2((i & 1) * 3 - 2, (i >> 1 & 1) - 1);
        ivec2 place = clamp(corner + (i < 4 ? away : away.yx), ivec2(0), last);
        if (texelFetch(pixel_labels, place, 0).rg == label) {
            nearest = place;
            least = 0.0;
        }
    }
    float known = least < OTHER && most > BEND * plane.x ? 1.0 : 0.0;
    colour_out = vec4(texelFetch(colours, nearest, 0).rgb, known);
}
