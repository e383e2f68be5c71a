#version 450 core
// What wet ground mirrors besides the sky: rays through the depth of the picture. What lies outside
// of the picture or behind something in it stays the mirrored sky.
#include "sky.glsl"
in vec3 ray;
layout(location = 0) out vec4 colour_out;

uniform vec4 lens;
uniform mat3 camera_axes;
uniform sampler2D colours;  // alpha: share of the mirrored light in a pixel
uniform sampler2D depth_map;

const int RAYS = 4;
const int STEPS = 30;
const float FIRST = 0.25, GROWTH = 1.22;  // metres; the last step ends at 98 m
const float LEAST = 0.004;  // share below which a mirrored image cannot be seen

// Pixel of a place in the camera's space, row 0 at the bottom.
ivec2 pixel_of(vec3 place, ivec2 size) {
    vec2 image = place.xy / place.z * lens.xy + lens.zw;
    return ivec2(floor(vec2(image.x, float(size.y - 1) - image.y) + 0.5));
}

// Colour where a ray meets what the picture shows; alpha is 0 if it meets nothing.
vec4 met(vec3 start, vec3 along, ivec2 size) {
    float near = 0.0, reach = FIRST;
    for (int step = 0; step < STEPS; ++step) {
        vec3 place = start + along * reach;
        ivec2 pixel = pixel_of(place, size);
        if (place.z < 0.1 || any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, size)))
            return vec4(0.0);
        float depth = texelFetch(depth_map, pixel, 0).r;
        float behind = place.z - depth;
        if (depth > 0.0 && behind > 0.0 && behind < 0.5 + 0.3 * (reach - near)) {
            for (int half_step = 0; half_step < 5; ++half_step) {
                float middle = 0.5 * (near + reach);
                vec3 there = start + along * middle;
                float seen = texelFetch(depth_map, pixel_of(there, size), 0).r;
                if (seen > 0.0 && there.z > seen) reach = middle;
                else near = middle;
            }
            return vec4(texelFetch(colours, pixel_of(start + along * reach, size), 0).rgb, 1.0);
        }
        near = reach;
        reach *= GROWTH;
    }
    return vec4(0.0);
}

float noise(vec2 place) {
    return fract(52.9829189 * fract(dot(place, vec2(0.06711056, 0.00583715))));
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), size = textureSize(depth_map, 0);
    vec4 colour = texelFetch(colours, pixel, 0);
    colour_out = vec4(colour.rgb, 1.0);
    float depth = texelFetch(depth_map, pixel, 0).r;
    if (colour.a < LEAST || depth <= 0.0) return;
    vec3 place = ray * depth;
    vec3 view = normalize(-place);
    // The share is (f0 + (1 - f0) g s) s s, with Schlick's g and the smoothness s: see colour.frag.
    float g = 0.96 * pow(1.0 - clamp(view.z, 0.0, 1.0), 5.0), s = 1.0;
    for (int turn = 0; turn < 4; ++turn) s = sqrt(colour.a / (0.04 + g * s));
    float roughness = 1.0 - sqrt(clamp(s, 0.0, 1.0));
    vec3 sum = vec3(0.0);
    for (int number = 0; number < RAYS; ++number) {
        vec2 draw = vec2(noise(vec2(pixel) + 5.0 * float(number)),
            noise(vec2(pixel.yx) + 11.0 * float(number) + 3.0)) - 0.5;
        vec3 normal = normalize(vec3(roughness * roughness * draw, 1.0));
        vec3 mirrored = reflect(-view, normal);
        mirrored = normalize(vec3(mirrored.xy, max(mirrored.z, 0.01)));
        vec4 image = met(place * camera_axes, mirrored * camera_axes, size);
        sum += image.a * (image.rgb - sky_radiance(mirrored, 0.9 * roughness));
    }
    colour_out.rgb = max(colour.rgb + colour.a * sum / float(RAYS), vec3(0.0));
}
