#version 450 core
#include "sky.glsl"
in vec3 ray;
layout(location = 0) out vec4 colour_out;

float hash(ivec2 cell) {
    uint n = uint(cell.x) * 1597334677u ^ uint(cell.y) * 3812015801u;
    n = (n ^ (n >> 15)) * 2246822519u;
    return float((n ^ (n >> 13)) & 0xffffffu) / 16777215.0;
}

float noise(vec2 place) {
    ivec2 cell = ivec2(floor(place));
    vec2 f = place - vec2(cell);
    f = f * f * (3.0 - 2.0 * f);
    float low = mix(hash(cell), hash(cell + ivec2(1, 0)), f.x);
    float high = mix(hash(cell + ivec2(0, 1)), hash(cell + ivec2(1, 1)), f.x);
    return mix(low, high, f.y);
}

float cloud(vec2 place) {
    float sum = 0.0, weight = 0.5;
    for (int octave = 0; octave < 5; ++octave) {
        sum += weight * noise(place);
        place = mat2(1.6, 1.2, -1.2, 1.6) * place;
        weight *= 0.5;
    }
    return smoothstep(0.48, 0.78, sum);
}

void main() {
    vec3 direction = normalize(ray);
    vec3 radiance = sky_radiance(direction);
    float height = max(direction.z, 0.0);
    float cover = cloud(2.2 * direction.xy / (height + 0.12)) * smoothstep(0.02, 0.25, height);
    vec3 white = 2.6 * sky_light + 0.55 * sun_light;
    radiance = mix(radiance, white, 0.75 * cover);
    float disc = smoothstep(0.99996, 0.99998, dot(direction, sun_direction));
    colour_out = vec4(developed(radiance + 40.0 * disc * sun_light), 1.0);
}
