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

const int RAYS = 2;  // of a rough surface
const float SMOOTH = 0.1;  // roughness up to which all rays take the same way
const int STEPS = 36;
const float FIRST = 0.25, GROWTH = 1.22;  // metres; the last step ends at 263 m
const float BRIGHTEST = 1.0;  // lamps themselves mirror in colour.frag, as highlights
const float LEAST = 0.004;  // share below which a mirrored image cannot be seen

// Pixel of a place in the camera's space, row 0 at the bottom.
ivec2 pixel_of(vec3 place, ivec2 size) {
    vec2 image = place.xy / place.z * lens.xy + lens.zw;
    return ivec2(floor(vec2(image.x, float(size.y - 1) - image.y) + 0.5));
}

// How far a point of a ray lies behind what the picture shows there; below 0 in front of the sky.
float behind(vec3 place, ivec2 size) {
    float depth = texelFetch(depth_map, pixel_of(place, size), 0).r;
    return depth > 0.0 ? place.z - depth : -1.0;
}

// Colour where a ray meets what the picture shows; alpha is 0 if it meets nothing. What the upper
// border of the picture cuts off goes on above it. A ray that vanishes behind something meets
// unknown things of about its colour.
vec4 met(vec3 start, vec3 along, ivec2 size) {
    float near = 0.0, reach = FIRST;
    vec4 hidden_by = vec4(0.0);
    for (int step = 0; step < STEPS; ++step) {
        vec3 place = start + along * reach;
        ivec2 pixel = pixel_of(place, size);
        if (place.z < 0.1 || pixel.y < 0 || pixel.x < 0 || pixel.x >= size.x) return hidden_by;
        if (pixel.y >= size.y) {
            ivec2 border = ivec2(pixel.x, size.y - 1);
            float depth = texelFetch(depth_map, border, 0).r;
            float on_it = depth > place.z && along.z > 0.0 ? 1.0 : 0.0;
            return vec4(texelFetch(colours, border, 0).rgb, on_it);
        }
        // Within a pixel, the ground itself seems to hide the ray.
        bvec2 away = greaterThan(abs(pixel - ivec2(gl_FragCoord.xy)), ivec2(1));
        bool hidden = any(away) && behind(place, size) > 0.0;
        if (hidden) {
            float in_front = near, met_at = reach;
            for (int half_step = 0; half_step < 6; ++half_step) {
                float middle = 0.5 * (in_front + met_at);
                if (behind(start + along * middle, size) > 0.0) met_at = middle;
                else in_front = middle;
            }
            vec3 there = start + along * met_at;
            // Farther behind, the ray passes behind an edge of something.
            if (behind(there, size) < 0.2 + 0.02 * there.z)
                return vec4(texelFetch(colours, pixel_of(there, size), 0).rgb, 1.0);
        }
        hidden_by = hidden ? vec4(texelFetch(colours, pixel, 0).rgb, 1.0) : vec4(0.0);
        near = reach;
        reach *= GROWTH;
    }
    return hidden_by;
}

// Two random numbers from 0 to 1.
vec2 drawn(ivec2 pixel, int number) {
    uint n = uint(pixel.x) * 1597334677u ^ uint(pixel.y) * 3812015801u ^ uint(number) * 2654435769u;
    n = (n ^ (n >> 15)) * 2246822519u;
    n ^= n >> 13;
    return vec2(n & 0xffffu, n >> 16) / 65535.0;
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
    int rays = roughness > SMOOTH ? RAYS : 1;
    for (int number = 0; number < rays; ++number) {
        vec2 slope = drawn(pixel, number) - 0.5;
        vec3 normal = normalize(vec3(roughness * roughness * slope, 1.0));
        vec3 mirrored = reflect(-view, normal);
        mirrored = normalize(vec3(mirrored.xy, max(mirrored.z, 0.01)));
        vec4 image = met(place * camera_axes, mirrored * camera_axes, size);
        sum += image.a * (min(image.rgb, BRIGHTEST) - sky_radiance(mirrored, 0.9 * roughness));
    }
    colour_out.rgb = max(colour.rgb + colour.a * sum / float(rays), vec3(0.0));
}
