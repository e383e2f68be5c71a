// A clear sky: blue overhead, pale at the horizon, a glow around the sun. `sky_light` is the
// irradiance of the sky on level ground, `sun_light` that of the sun on a surface that faces it.
uniform vec3 sun_direction;
uniform vec3 sun_light;
uniform vec3 sky_light;
uniform float exposure;

vec3 sky_radiance(vec3 direction) {
    float height = clamp(direction.z, 0.0, 1.0);
    float pale = pow(1.0 - height, 3.0);
    vec3 hue = mix(vec3(0.62, 0.84, 1.16), vec3(1.35, 1.18, 1.0), pale);
    vec3 radiance = sky_light * hue * mix(0.85, 2.3, pale);
    float towards = max(dot(direction, sun_direction), 0.0);
    float glow = 0.10 * pow(towards, 6.0) + 0.5 * pow(towards, 60.0);
    return radiance + sun_light * glow;
}

// Light of the sky, and of sunlit ground and walls, on a surface with this normal that sees a
// share of the sky.
vec3 ambient_light(vec3 normal, float share) {
    float up = 0.5 + 0.5 * normal.z;
    vec3 bounced = 0.16 * (sky_light + sun_light * max(sun_direction.z, 0.0));
    return mix(bounced, mix(bounced * 0.7, sky_light, share), up);
}

// The film curve of K. Narkowicz, "ACES filmic tone mapping curve" (2016), with exposure.
vec3 developed(vec3 radiance) {
    vec3 x = radiance * exposure;
    return clamp((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
}
