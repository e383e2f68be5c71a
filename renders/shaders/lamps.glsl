// Lamps near the camera, as points. They cast no shadows.
const int LAMPS = 32;  // see render/lighting/lamp_uniforms.py
#ifndef lamp_count
uniform int lamp_count;
#endif
uniform vec3 lamp_places[LAMPS];  // relative to the camera, metres
uniform vec3 lamp_powers[LAMPS];  // irradiance over pi at 1 m on the axis
uniform vec3 lamp_axes[LAMPS];
uniform vec3 lamp_beams[LAMPS];  // 1 if the light falls with the cosine; cosine of the beam's edge

// Irradiance over pi of a surface that faces the lamp; `towards` becomes the direction to it.
vec3 lamplight(int lamp, vec3 place, out vec3 towards) {
    vec3 away = lamp_places[lamp] - place;
    float square = max(dot(away, away), 0.01);
    towards = away * inversesqrt(square);
    float along = -dot(towards, lamp_axes[lamp]);
    float shape = mix(1.0, max(along, 0.0), lamp_beams[lamp].x);
    shape *= smoothstep(lamp_beams[lamp].y - 0.02, lamp_beams[lamp].y + 0.02, along);
    return lamp_powers[lamp] * shape / square;
}
