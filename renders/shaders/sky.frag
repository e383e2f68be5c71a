#version 450 core
#include "sky.glsl"
in vec3 ray;
layout(location = 0) out vec4 colour_out;

const float DISC = 0.0000679;  // solid angle of the sun in steradian
const float BRIGHTEST = 3000.0;  // largest radiance; a camera saturates far below it

void main() {
    vec3 direction = normalize(ray);
    float disc = smoothstep(0.999985, 0.999992, dot(direction, sun_direction));
    vec3 sun = min(3.1415927 / DISC * sun_light, vec3(BRIGHTEST));
    colour_out = vec4(sky_radiance(direction, 0.0) + disc * sun, 1.0);
}
