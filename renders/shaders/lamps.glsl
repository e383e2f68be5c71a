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

const int HEADLAMPS = 2;  // see render/lighting/headlamps.py
uniform int headlamp_count;
uniform vec3 headlamp_places[HEADLAMPS];  // relative to the camera, metres
uniform vec3 headlamp_ahead;
uniform vec3 headlamp_power;  // irradiance over pi at 1 m from a lamp of 1 kcd

// Intensity of a low beam for right-hand traffic in kcd, at angles in degrees below the axis and to
// its left: a hot spot below the cut-off, a wide foreground, a little light above, within the limits
// of UN Regulation 112, class B.
float low_beam(float below, float aside) {
    float under = max(below - 0.57, 0.0), wide = aside * aside, off = aside + 2.0;
    float spot = 15.0 * exp(-off * off / 40.0 - under / 1.8);
    float foreground = 4.0 * exp(-wide / 625.0 - under / 6.0);
    return mix(0.15 * exp(-wide / 900.0), spot + foreground, smoothstep(0.2, 0.57, below));
}

// As lamplight, of a headlamp.
vec3 headlight(int lamp, vec3 place, out vec3 towards) {
    vec3 away = headlamp_places[lamp] - place;
    float square = max(dot(away, away), 0.01);
    towards = away * inversesqrt(square);
    vec2 beam = normalize(headlamp_ahead.xy), level = -normalize(towards.xy);
    float below = degrees(asin(headlamp_ahead.z) + asin(towards.z));
    float aside = degrees(atan(beam.x * level.y - beam.y * level.x, dot(beam, level)));
    return headlamp_power * low_beam(below, aside) / square;
}
